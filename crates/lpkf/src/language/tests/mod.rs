//! What the tests share: everything a line amounts to, and every kind of command.

mod catalogue;
mod garbage;
mod round_trip;
mod rules;
mod stream;
mod tables;

use super::{Command, Dialect, Item, Reader, Status};

/// What these bytes amount to on a line that is new.
pub(crate) fn items(model: Dialect, bytes: &[u8]) -> Vec<Item> {
    feed(&mut Reader::new(model), bytes)
}

pub(crate) fn feed(reader: &mut Reader, bytes: &[u8]) -> Vec<Item> {
    let mut items = Vec::new();
    bytes.iter().for_each(|&byte| reader.feed(byte, |item| items.push(item)));
    items
}

/// What the one command in these bytes means.
pub(crate) fn read(model: Dialect, text: &str) -> Result<Command, Status> {
    match items(model, text.as_bytes()).as_slice() {
        [Item::Command { command, .. }] => command.clone(),
        other => panic!("{text:?} is {other:?}"),
    }
}

pub(crate) fn print(command: &Command) -> Vec<u8> {
    let mut printed = Vec::new();
    command.print(&mut printed);
    printed
}
