//! Several controllers, and a plant of one's own, in one time.

use std::time::Duration;

use vimc4::{Condition, Group, Member, Simulation, Time, World};

type Result = std::result::Result<(), Box<dyn std::error::Error>>;

#[test]
fn the_mill_waits_until_the_feeder_has_fed() -> Result {
    let (model, bench) = (vimc4::model("imc-s8")?, vimc4::machine("bench")?);
    let mut group = Group::new();
    let feeder = group.join(&model, &bench)?;
    let mill = group.join(&model, &bench)?;
    // Output bit 3 of the feeder says "fed", output bit 0 of the mill says "milled".
    group.wire((feeder, 0, 3), (mill, "input 0.3"))?;
    group.wire((mill, 0, 0), (feeder, "input 0.0"))?;

    // The mill's program waits as long as bit 3 of its port 0 is 0, and then moves.
    group.send(mill, b"@01\r@0i\ro0,3,0,-1\r0400,400\r9\r")?;
    group.set(mill, "start", 1)?;
    group.set(mill, "start", 0)?;
    group.send(feeder, b"@01\r@0A800,400\r@0B0,8\r")?;

    // The feed takes two seconds. Meanwhile the mill has not moved.
    group.run_until(feeder, &Condition::AxisAt { axis: 0, position: 400 })?;
    assert_eq!((group.position(feeder)[0], group.position(mill)[0]), (400, 0));
    group.run_until_idle()?;
    assert_eq!((group.position(feeder)[0], group.position(mill)[0]), (800, 400));

    group.take_bytes(feeder);
    group.send(mill, b"@0B0,1\r")?;
    group.send(feeder, b"@0b0\r")?;
    assert_eq!(group.take_bytes(feeder), b"001");
    Ok(())
}

/// An oven: it warms up by a degree in 100 ms while its heater is on, and then a contact closes.
#[derive(Clone, Debug, Default, PartialEq)]
struct Oven {
    /// Who heats it, and since when.
    heated: Option<(Member, Time)>,
    /// How warm it was then.
    degrees: u64,
}

const HOT: u64 = 60;
const DEGREE: Duration = Duration::from_millis(100);

impl Simulation for Oven {
    /// Computed once, when the heater is switched: nothing asks for the temperature on the way.
    fn due(&self) -> Option<Time> {
        let (_, since) = self.heated.filter(|_| self.degrees < HOT)?;
        Some(since + DEGREE * (HOT - self.degrees) as u32)
    }

    fn act(&mut self, world: &mut World<'_>) {
        if let Some((by, since)) = &mut self.heated {
            (self.degrees, *since) = (HOT, world.now());
            world.set(*by, "input 0.0", 1);
        }
    }

    /// Bit 0 of port 0 is the heater. To be brief, the oven stays as warm as it is.
    fn output(&mut self, of: Member, port: u16, value: u8, world: &mut World<'_>) {
        if port == 0 {
            if let Some((_, since)) = self.heated {
                let warmed = (world.now() - since).as_millis() / DEGREE.as_millis();
                self.degrees = HOT.min(self.degrees + warmed as u64);
            }
            self.heated = (value & 1 == 1).then_some((of, world.now()));
        }
    }
}

#[test]
fn the_driver_waits_for_the_oven() -> Result {
    let mut group = Group::with(Oven { heated: None, degrees: 20 });
    let control = group.join(&vimc4::model("imc-s8")?, &vimc4::machine("bench")?)?;
    group.send(control, b"@01\r@0B0,1\r")?;
    let heating = group.state();

    // From 20 to 60 degrees takes four seconds; the contact is seen in that instant.
    let hot = group.run_until_idle()?;
    assert_eq!(hot - heating.now(), Duration::from_secs(4));
    group.take_bytes(control);
    group.send(control, b"@0b0\r")?;
    assert_eq!(group.take_bytes(control), b"001");

    // Rolled back: what if the heater fails after three?
    group.restore(&heating)?;
    group.advance(Duration::from_secs(3))?;
    group.send(control, b"@0B0,0\r")?;
    group.advance(Duration::from_secs(60))?;
    group.take_bytes(control);
    group.send(control, b"@0b0\r")?;
    assert_eq!(group.take_bytes(control), b"000");
    assert_eq!(group.simulation().degrees, 50);
    Ok(())
}
