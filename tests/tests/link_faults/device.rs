//! The controller's firmware without its board.

use delta_cal_firmware_example::{
    Background, Controller, Foreground, Handover, Number, ParameterFlash, StreamFlash, StreamPace,
    Timer, nominal,
};

/// Turns of the control loop between two looks at the link.
const TURNS: u32 = 20;

/// Time stands still: nothing here depends on it.
struct Still;

impl Timer for Still {
    const TICKS_A_SECOND: u32 = 25_000_000;
    const MASK: u32 = 0x00ff_ffff;
    fn now(&self) -> u32 {
        0
    }
}

/// A controller that is switched on.
struct On<T: Number> {
    controller: Controller<T, ParameterFlash, StreamFlash>,
    background: Background<'static, T>,
    foreground: Foreground<'static, T>,
}

impl<T: Number> On<T> {
    fn start(flash: ParameterFlash, stream_flash: StreamFlash, pace: StreamPace) -> Self {
        let mut controller = Controller::new(nominal().unwrap(), flash, stream_flash, 0);
        controller.set_stream_pace(pace);
        controller.resume();
        // Static memory on a controller; here a kilobyte that stays allocated after each start.
        let handover = Box::leak(Box::new(Handover::new()));
        let (background, foreground) = handover.split(&controller.current());
        Self {
            controller,
            background,
            foreground,
        }
    }
}

/// When a controller loses its supply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// It has acted on the request, and its answer is lost.
    BeforeTheAnswer,
    /// The answer has left.
    AfterTheAnswer,
}

/// A controller with its control loop, which can be restarted.
pub(crate) struct Device<T: Number> {
    on: Option<On<T>>,
    /// Whole frames that were answered so far.
    pub(crate) answered: usize,
    /// Restarts at the frame of this number.
    pub(crate) restart_at: Option<(usize, Cut)>,
    /// Fingerprints of all parameters that were ever in use, in their order.
    pub(crate) used: Vec<u32>,
    pace: StreamPace,
}

impl<T: Number> Device<T> {
    pub(crate) fn new() -> Self {
        Self::with(StreamPace::default())
    }

    /// Whose samples are stored as often as that.
    pub(crate) fn with(pace: StreamPace) -> Self {
        let on = On::<T>::start(ParameterFlash::new(), StreamFlash::new(), pace);
        let used = vec![on.controller.current().fingerprint];
        Self {
            on: Some(on),
            answered: 0,
            restart_at: None,
            used,
            pace,
        }
    }

    pub(crate) fn restart(&mut self) {
        let (flash, stream_flash) = self.on.take().unwrap().controller.into_flash();
        self.on = Some(On::start(flash, stream_flash, self.pace));
    }

    /// Takes in a byte; the bytes that it answers with.
    pub(crate) fn receive(&mut self, byte: u8) -> Vec<u8> {
        let Some(answer) = self.on.as_mut().unwrap().controller.receive(byte) else {
            return Vec::new();
        };
        let answer = answer.to_vec();
        let index = self.answered;
        self.answered += 1;
        let cut = match self.restart_at {
            Some((at, cut)) if at == index => {
                self.restart();
                Some(cut)
            }
            _ => None,
        };
        self.look();
        match cut {
            Some(Cut::BeforeTheAnswer) => Vec::new(),
            _ => answer,
        }
    }

    /// Turns of the control loop, and one step in the background: what the firmware's idle loop
    /// does.
    pub(crate) fn run(&mut self) {
        let on = self.on.as_mut().unwrap();
        for _ in 0..TURNS {
            on.foreground.turn(&Still, |_| {});
            if let Some(state) = on.background.state() {
                on.controller.set_control(state);
            }
            if on.background.ready()
                && let Some(parameters) = on.controller.take_switch()
            {
                on.background.hand_over(parameters).unwrap();
            }
        }
        on.controller.idle();
        self.look();
    }

    /// The parameters that the control loop computes with.
    pub(crate) fn in_loop(&self) -> [[u64; 8]; 3] {
        let robot = *self.on.as_ref().unwrap().foreground.control_loop().robot();
        robot
            .arms()
            .map(|arm| arm.parameters().map(|value| value.to_f64().to_bits()))
    }

    fn look(&mut self) {
        let now = self.on.as_ref().unwrap().controller.current().fingerprint;
        if self.used.last() != Some(&now) {
            self.used.push(now);
        }
    }
}
