//! A little of everything.

use std::time::Duration;

use vimc4_device::{Device, Input};

/// Has a controller do a little of everything for a little while: what its profile or its flash
/// memory says must not break it.
pub(super) fn exercise(controller: &mut impl Device, inputs: &[Input<'_>]) {
    for input in inputs {
        controller.handle(*input, controller.now());
        for _ in 0..40 {
            while controller.poll_output().is_some() {}
            let Some(wake) = controller.wake() else { break };
            assert!(wake >= controller.now(), "wants to be woken in the past");
            let between = wake.nanos_since(controller.now()) / 2;
            let view = controller.view(controller.now().after_nanos(between));
            assert_eq!(view.timers.first().map(|timer| timer.due), Some(wake));
            // An hour at most: a reference run without a switch goes on for years.
            controller.handle(Input::Wake, wake.min(controller.now() + Duration::from_secs(3_600)));
        }
    }
}
