//#define LARGE
#define DELTA
#if ENABLED(DELTA) && !defined(LARGE)
  //#define DELTA_HEIGHT 1
  /* #define DELTA_HEIGHT 2
  #define DELTA_HEIGHT 3 */
  #define VERSION 2
  #define DELTA_HEIGHT 411.8f /* G33 */ // (mm)
  #define DELTA_ENDSTOP_ADJ  \
    {-1.1, 0.0, -1.0} // (mm)
  #if EITHER(LARGE, HUGE) || VERSION < 2
    #define DELTA_DIAGONAL_ROD 440
    #define DELTA_RADIUS 200
  #elif VERSION == 2
    #define DELTA_DIAGONAL_ROD 330.1 // mm
    #define OFFSET 30
    #define DELTA_RADIUS (200.2-(OFFSET)-2*14.5)
  #else
    #define DELTA_RADIUS 210
  #endif
  #define DELTA_TOWER_ANGLE_TRIM { 0.3, -0.2, 0.1 }
  // Delta radius and diagonal rod adjustments
  #define DELTA_RADIUS_TRIM_TOWER { 0.0, 0.0, 0.0 }
  #define DELTA_DIAGONAL_ROD_TRIM_TOWER { 0.0, 0.3, -0.3 }
#endif
#if ENABLED(POLAR)
  #define DELTA_RADIUS 82
#endif
