; my config
M550 P"hunter2"
M665 R100 L200 ; older
M665 R141.2 L330.1:330.4:329.8 B120 H412.5 X0.3 Y-0.2 Z0.1 ; delta
M666 X0.4 Y-0.7 Z0.3 A0 B0
;M665 R150 L351.1 B145 H530 ; set delta radius, diagonal rod length, printable radius and homed height
