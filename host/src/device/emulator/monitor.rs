use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

const PROMPT: &[u8] = b"(qemu) ";
const ANSWERS_WITHIN: Duration = Duration::from_secs(20);

/// QEMU's monitor: commands for people, one a line.
#[derive(Debug)]
pub(super) struct Monitor {
    stream: TcpStream,
    /// The greeting's prompt was seen.
    greeted: bool,
}

impl Monitor {
    pub(super) const fn new(stream: TcpStream) -> Self {
        Self {
            stream,
            greeted: false,
        }
    }

    /// Stops the controller and writes a part of its memory to a file.
    pub(super) fn save_memory(&mut self, address: u64, size: u64, file: &Path) -> io::Result<()> {
        self.stream.set_read_timeout(Some(ANSWERS_WITHIN))?;
        if !self.greeted {
            self.until_prompt()?;
            self.greeted = true;
        }
        self.command("stop")?;
        let name = file
            .to_str()
            .ok_or_else(|| io::Error::other("its name is not UTF-8"))?
            .replace('\\', "\\\\")
            .replace('"', "\\\"");
        self.command(&format!("pmemsave {address:#x} {size:#x} \"{name}\""))
    }

    fn command(&mut self, line: &str) -> io::Result<()> {
        self.stream.write_all(format!("{line}\n").as_bytes())?;
        self.until_prompt()
    }

    fn until_prompt(&mut self) -> io::Result<()> {
        let mut said = Vec::new();
        let mut byte = [0];
        while !said.ends_with(PROMPT) {
            self.stream.read_exact(&mut byte)?;
            said.extend(byte);
        }
        Ok(())
    }
}
