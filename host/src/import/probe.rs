//! The probe beside the nozzle, and the commands that touch the bed with it.

use super::settings::Settings;
use super::{Firmware, Imported};
use crate::files::InputError;
use crate::text::tenths;

/// A probe is this far above the bed between touches if nothing says that it has to be higher, mm.
const USUAL_CLEARANCE: f64 = 10.0;
/// Above the height at which the probe triggers, mm.
const ABOVE_TRIGGER: f64 = 5.0;

/// What a configuration states of the probe.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Probe {
    /// Where the probe is beside the nozzle, mm; `None` if it is not stated.
    pub offset: Option<[f64; 2]>,
    /// How high the nozzle is above the bed when the probe triggers, mm.
    pub(super) trigger: f64,
    /// The height of the nozzle between touches that is stated, mm.
    pub(super) clearance: f64,
}

impl Probe {
    /// With the offset and the height at which it triggers in these options of a section or words of a command; without x
    /// and y it is below the nozzle where the firmware assumes so.
    pub(super) fn of(
        settings: &Settings,
        section: &str,
        [x, y, z]: [&str; 3],
    ) -> Result<Self, InputError> {
        let number = |option| settings.number(section, option);
        let (own_x, own_y, z) = (number(x)?, number(y)?, number(z)?);
        let assumed = settings.firmware != Firmware::Marlin && settings.states(section);
        let stated = own_x.is_some() || own_y.is_some() || assumed;
        let offset = [own_x, own_y].map(Option::unwrap_or_default);
        Ok(Self {
            offset: stated.then_some(offset),
            trigger: z.unwrap_or_default().abs(),
            clearance: 0.0,
        })
    }

    /// How far it is from the nozzle, mm.
    pub fn distance(&self) -> f64 {
        self.offset.map_or(0.0, |[x, y]| x.hypot(y))
    }
}

impl Imported {
    /// The height of the nozzle at which the probe is clear of the bed, mm.
    fn clearance(&self) -> f64 {
        let rows = self.readings.rows.iter();
        let heights = rows.filter_map(|row| row.value.height.map(|(_, height)| height));
        let highest = heights.fold(self.probe.trigger, f64::max);
        let above = highest + ABOVE_TRIGGER;
        above.max(self.probe.clearance).max(USUAL_CLEARANCE)
    }

    /// The commands that touch the bed with the nozzle at these places, mm.
    ///
    /// # Errors
    /// A firmware without commands that home and probe a Delta.
    pub fn touches(&self, places: &[[f64; 2]]) -> Result<String, InputError> {
        let clear = format!("{:.1}", self.clearance());
        let words = self.firmware.words();
        if words.touch.is_empty() {
            let cause = format!("no commands that touch a bed are known for {}", words.title);
            return Err(InputError::new(&self.readings.name, cause).with_remedy(
                "delta-cal import writes a robot file; plan for that, with --measure plane",
            ));
        }
        let [beside_x, beside_y] = self.probe.offset.unwrap_or_default();
        let touch = |[x, y]: &[f64; 2]| match self.firmware {
            // Marlin moves the probe there, not the nozzle.
            Firmware::Marlin => {
                let [x, y] = [x + beside_x, y + beside_y].map(tenths);
                format!("G30 X{x:.1} Y{y:.1}")
            }
            _ => format!("G1 X{x:.1} Y{y:.1} F3000\n{}", words.touch),
        };
        let touches = places.iter().map(touch);
        let touches = touches.map(|own| format!("{own}\nG1 Z{clear} F600\n"));
        Ok(format!(
            "; To stop at once: M112, then restart. Watch the first touch: the probe must be deployed and clear of the bed.\n\
             G28\n\
             G1 Z{clear} F600 ; slowly, from above\n{}",
            touches.collect::<String>()
        ))
    }
}
