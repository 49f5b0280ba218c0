//! The image of the flash memory, as a file may hold it.

use vimc4_device::Device;
use vimc4_isel::Controller;

use crate::fuzzing::chance::Chance;
use crate::fuzzing::exercise::exercise;
use crate::fuzzing::operations::Setup;

use super::setups::{inputs, model};

/// An image is refused, or it is read, written and read again as the same, and a controller
/// works with it.
///
/// The first three bytes say which controller, see [`Setup`]; the image is what remains.
pub fn flash(data: &[u8]) {
    let (setup, image) = Setup::decode(data);
    let open = |image: &[u8]| Controller::new(model(setup), setup.machine(), image);
    let mut controller = match open(image) {
        Ok(controller) => controller,
        Err(error) => {
            let lines = image.split(|&byte| byte == b'\n').count();
            assert!((1..=lines).contains(&error.line), "no line of the image: {error}");
            return;
        }
    };
    let written = controller.flash_image();
    let again = open(&written).unwrap_or_else(|error| {
        unreachable!("its own image is refused: {error}: {}", written.escape_ascii())
    });
    assert!(again.flash_image() == written && again.state() == controller.state());
    // A host can be killed while it writes: what is cut off anywhere is still an image.
    let mut chance = Chance::of(data);
    for _ in 0..4 {
        let cut = chance.below(image.len() as u64 + 1) as usize;
        assert!(open(&image[..cut]).is_ok(), "refused after {cut} bytes");
    }
    exercise(&mut controller, &inputs());
}
