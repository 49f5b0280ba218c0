//! Storing a CNC data field, line by line.

use vimc4_isel_wire::{Command, Mode, Op};

use crate::firmware::Firmware;
use crate::flash::{INVALID_LINE, end_line, line_line};
use crate::program::{Program, StoredLine, Validity, parse_stored};
use crate::why::Why;

impl Firmware {
    /// `i`: what follows is stored.
    pub(crate) fn begin_storing(&mut self) {
        self.state.flash.program = Some(Program::begin(self.state.axes, self.state.speeds));
        // Writes a whole image, so that the lines to come are never added to a torn one.
        self.replace_flash_image();
        self.state.run = None;
        self.state.storing = true;
        self.flash_changed("program begun");
    }

    /// Stores a line, or ends storing with an error that makes the program invalid.
    pub(crate) fn store_line(&mut self, text: &[u8]) {
        match self.storable(text) {
            Ok((command, size)) => {
                let op = command.op(Mode::Stored);
                self.announce(self.mnemonic(Mode::Stored, op), text);
                match self.store(command, size, text) {
                    Ok(()) => self.done(Mode::Stored, op),
                    Err(why) => self.refuse(Mode::Stored, op, why),
                }
            }
            Err((op, why)) => {
                let mnemonic = op.map_or("?", |op| self.mnemonic(Mode::Stored, op));
                self.announce(mnemonic, text);
                self.invalidate_program();
                self.refuse_line(mnemonic, why, text, Mode::Stored);
            }
        }
    }

    fn store(&mut self, command: Command, size: u32, text: &[u8]) -> Result<(), Why> {
        let capacity = self.state.model.flash.size;
        let speeds = self.state.speeds;
        let Some(program) = &mut self.state.flash.program else { return Err(Why::NothingToStart) };
        let whole = program.size.saturating_add(size);
        if whole > capacity {
            self.invalidate_program();
            return Err(Why::MemoryFull(whole));
        }
        if command == Command::End {
            program.validity = Validity::Valid;
            program.speeds = speeds;
            let record = end_line(program);
            self.append_to_flash_image(record);
            self.state.storing = false;
            self.flash_changed("program valid");
            return Ok(());
        }
        program.push(StoredLine { command, text: text.to_vec() }, size);
        self.append_to_flash_image(line_line(text));
        self.flash_changed("program line");
        Ok(())
    }

    /// An error while storing: the program cannot run, and storing ends.
    pub(crate) fn invalidate_program(&mut self) {
        self.state.storing = false;
        if let Some(program) = &mut self.state.flash.program {
            program.validity = Validity::Invalid;
            self.append_to_flash_image(INVALID_LINE.to_owned());
            self.flash_changed("program invalid");
        }
    }

    /// Forgets the stored program.
    pub(crate) fn erase_program(&mut self) {
        self.state.flash.program = None;
        self.state.run = None;
        self.replace_flash_image();
        self.flash_changed("erased");
    }

    /// Whether a text could be stored as the next line, and how much memory it takes.
    fn storable(&self, text: &[u8]) -> Result<(Command, u32), (Option<Op>, Why)> {
        let line = self.state.flash.program.as_ref().map(Program::len);
        parse_stored(text, &self.state.model, &self.state.context(line))
    }
}
