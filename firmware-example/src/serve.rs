//! Runs the controller on a link of `embedded-io-async`.

use crate::{Controller, Number};
use embassy_futures::yield_now;
use embedded_io_async::{Read, ReadReady, Write};
use embedded_storage::nor_flash::NorFlash;

impl<T: Number, F: NorFlash, S: NorFlash> Controller<T, F, S> {
    /// Serves a link until it ends: processes and answers incoming bytes, and does background work while nothing
    /// arrives. `between` runs after every byte and every step. It must hand new parameters to the control loop, and
    /// the loop's state to [`set_control`](Self::set_control), as `firmware.rs` does.
    ///
    /// Run it in its own task with the lowest priority: a step of the solver takes about 20,000 instructions, and
    /// storing takes as long as the flash needs.
    ///
    /// # Errors
    /// Errors of the link.
    pub async fn serve<L: Read + ReadReady + Write>(
        &mut self,
        link: &mut L,
        mut between: impl FnMut(&mut Self),
    ) -> Result<(), L::Error> {
        let mut buffer = [0; 64];
        loop {
            if !link.read_ready()? {
                self.idle();
                between(self);
                yield_now().await;
                continue;
            }
            let count = link.read(&mut buffer).await?;
            if count == 0 {
                return Ok(());
            }
            for byte in buffer.iter().take(count) {
                if let Some(answer) = self.receive(*byte) {
                    link.write_all(&answer).await?;
                    link.flush().await?;
                }
                between(self);
            }
        }
    }
}
