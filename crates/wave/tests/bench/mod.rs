//! A controller with an analyser, and waveforms read again.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::{Arc, Mutex};

use vimc4_catalogue::{Controller, Model, machine, model};
use vimc4_device::{
    AXES, Device as _, Event, Harness, Input, Line, Motion, Output, Path, Point, Time,
};
use vimc4_wave::{Analyser, Csv, Drives, Fst, Pacing, Paper, Scene, Trace, Vcd};

/// A file in memory.
#[derive(Clone, Default)]
pub(crate) struct Shared(Arc<Mutex<Contents>>);

#[derive(Default)]
struct Contents {
    bytes: Vec<u8>,
    /// Where the next bytes are appended.
    end: usize,
}

impl Contents {
    fn write(&mut self, offset: usize, bytes: &[u8]) {
        let length = self.bytes.len().max(offset + bytes.len());
        self.bytes.resize(length, 0);
        self.bytes[offset..offset + bytes.len()].copy_from_slice(bytes);
    }
}

impl Shared {
    fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().bytes.clone()
    }
}

impl Paper for Shared {
    fn put(&mut self, bytes: &[u8]) {
        let mut contents = self.0.lock().unwrap();
        let end = contents.end;
        contents.write(end, bytes);
        contents.end += bytes.len();
    }

    fn put_at(&mut self, offset: u64, bytes: &[u8]) {
        self.0.lock().unwrap().write(usize::try_from(offset).unwrap(), bytes);
    }
}

#[derive(Clone, Copy)]
pub(crate) enum Format {
    Vcd,
    Csv,
    Trace,
}

pub(crate) struct Bench {
    pub(crate) harness: Harness<Line<Controller>>,
    model: Model,
    analyser: Option<Analyser>,
    vcd: Shared,
    fst: Shared,
    csv: Shared,
    trace: Shared,
    running: Option<(Time, vimc4_device::Segment)>,
    /// The steps of each axis, as the motions say in closed form.
    pub(crate) travelled: [u64; AXES],
    /// The sum of those with the sign of their direction.
    pub(crate) net: Point,
    /// Where the controller says it was.
    pub(crate) places: Vec<(Time, Point)>,
    pub(crate) given: Vec<u8>,
    pub(crate) sent: Vec<u8>,
    pub(crate) sent_at: Vec<Time>,
    pub(crate) commands: Vec<Time>,
}

fn drives(model: &Model) -> impl Fn(&vimc4_device::View<vimc4_catalogue::Details>) -> Drives {
    move |view| {
        let [motors, spindle] = model.drives(view);
        Drives { motors, spindle }
    }
}

impl Bench {
    pub(crate) fn new(name: &str, on: &str, paced: bool) -> Bench {
        let (model, machine) = (model(name).unwrap(), machine(on).unwrap());
        let controller = Controller::new(&model, machine, b"").unwrap();
        let (line, pacing) = match paced {
            true => (Line::paced(controller), Pacing::Paced),
            false => (Line::ideal(controller), Pacing::Ideal),
        };
        let harness = Harness::new(line).watching(Analyser::KINDS);
        let files: [Shared; 4] = Default::default();
        let [vcd, fst, csv, trace] = files.clone();
        let analyser = Analyser::new(
            harness.device(),
            pacing,
            drives(&model),
            vec![
                Box::new(Vcd::new(vcd)),
                Box::new(Fst::new(fst)),
                Box::new(Csv::new(csv)),
                Box::new(Trace::new(trace)),
            ],
        );
        let [vcd, fst, csv, trace] = files;
        let mut bench = Bench {
            harness,
            model,
            analyser: Some(analyser),
            vcd,
            fst,
            csv,
            trace,
            running: None,
            travelled: [0; AXES],
            net: [0; AXES],
            places: Vec::new(),
            given: Vec::new(),
            sent: Vec::new(),
            sent_at: Vec::new(),
            commands: Vec::new(),
        };
        bench.look();
        bench
    }

    pub(crate) fn now(&self) -> Time {
        self.harness.now()
    }

    pub(crate) fn scene(&self) -> Scene {
        Scene::of(self.harness.device())
    }

    pub(crate) fn axes(&self) -> Vec<String> {
        let view = self.harness.device().view(self.now());
        let mut names = vec![String::new(); view.axes.len()];
        for axis in view.axes {
            names[usize::from(axis.index)] = axis.name.to_lowercase();
        }
        names
    }

    pub(crate) fn press(&mut self, name: &str, value: i32) {
        let signals = self.harness.device().signals();
        let id = signals.iter().find(|signal| signal.name == name).unwrap().id;
        self.give(Input::Signal(id, value));
    }

    pub(crate) fn give(&mut self, input: Input<'_>) {
        if let Input::Bytes(bytes) = input {
            self.given.extend_from_slice(bytes);
        }
        let now = self.now();
        self.analyser.as_mut().unwrap().given(now, input);
        self.harness.accept(input);
        self.look();
        self.run_to(now);
    }

    pub(crate) fn run_to(&mut self, at: Time) {
        while self.harness.due().is_some_and(|due| due <= at) && self.harness.step().is_some() {
            self.look();
        }
        self.harness.run_to(at);
        self.look();
    }

    /// Somebody puts the controller into another state.
    pub(crate) fn put(
        &mut self,
        state: <Line<Controller> as vimc4_device::Device>::State,
        by: &str,
    ) {
        self.harness.restore(state);
        self.running = None;
        let analyser = self.analyser.as_mut().unwrap();
        analyser.restored(self.harness.device(), by, drives(&self.model));
    }

    fn look(&mut self) {
        let analyser = self.analyser.as_mut().unwrap();
        while let Some(output) = self.harness.take_output() {
            match output {
                Output::Bytes(at, bytes) => {
                    self.sent.extend_from_slice(&bytes);
                    self.sent_at.extend(bytes.iter().map(|_| at));
                    analyser.sent(at, &bytes);
                }
                Output::Event(stamp, event) => {
                    analyser.see(stamp.at, &event);
                    match event {
                        Event::Command { .. } => self.commands.push(stamp.at),
                        Event::Motion(Motion::Begins { segment, .. }) => {
                            self.running = Some((stamp.at, *segment));
                        }
                        Event::Motion(Motion::Changes { segment }) => {
                            if let Some((_, running)) = &mut self.running {
                                *running = *segment;
                            }
                        }
                        Event::Motion(Motion::Ends { steps }) => {
                            // After going back it may have begun before.
                            if let Some((_, segment)) = self.running.take() {
                                add(&mut self.travelled, &mut self.net, &segment.path, steps);
                            }
                        }
                        _ => {}
                    }
                }
                Output::Flash(..) => {}
            }
        }
        analyser.look(self.harness.device(), drives(&self.model));
        let now = self.harness.now();
        let place = (now, self.harness.device().position(now));
        // At one instant the last place counts.
        self.places.pop_if(|(at, _)| *at == now);
        self.places.push(place);
    }

    /// What the running motion has made belongs to it.
    pub(crate) fn settle(&mut self) {
        let now = self.now();
        if let Some((began, segment)) = self.running.take() {
            let made = segment.profile.steps_at(now.nanos_since(began));
            add(&mut self.travelled, &mut self.net, &segment.path, made);
        }
    }

    fn end(&mut self) {
        let now = self.now();
        if let Some(analyser) = self.analyser.take() {
            analyser.finish(now);
        }
    }

    /// The waveforms, as VCD and as FST.
    pub(crate) fn finish(mut self) -> Vec<Wave> {
        self.end();
        [&self.vcd, &self.fst].into_iter().map(|file| Wave::read(file.bytes())).collect()
    }

    pub(crate) fn text(&mut self, format: Format) -> String {
        self.end();
        self.written(format)
    }

    /// What a file has so far.
    pub(crate) fn written(&self, format: Format) -> String {
        let file = match format {
            Format::Vcd => &self.vcd,
            Format::Csv => &self.csv,
            Format::Trace => &self.trace,
        };
        String::from_utf8(file.bytes()).unwrap()
    }

    /// Writes what has been drawn, and returns the waveforms as they are then in the files.
    pub(crate) fn flush(&mut self) -> [Vec<u8>; 2] {
        self.analyser.as_mut().unwrap().flush();
        [self.vcd.bytes(), self.fst.bytes()]
    }
}

fn add(travelled: &mut [u64; AXES], net: &mut Point, path: &Path, steps: u64) {
    let (travel, way) = (path.travel(steps), path.at(steps));
    for axis in 0..AXES {
        travelled[axis] += travel[axis].unsigned_abs();
        net[axis] += way[axis];
    }
}

/// A waveform as another program reads it: the changes of each signal by its path without the name
/// of the whole.
pub(crate) struct Wave {
    pub(crate) changes: BTreeMap<String, Vec<(u64, String)>>,
    end: u64,
}

impl Wave {
    pub(crate) fn read(bytes: Vec<u8>) -> Wave {
        let mut read = wellen::simple::read_from_reader(Cursor::new(bytes)).unwrap();
        let vars: Vec<_> = read.hierarchy().all_vars().collect();
        let named: Vec<_> = vars
            .into_iter()
            .map(|var| {
                let var = &read.hierarchy()[var];
                (var.full_name(read.hierarchy()), var.signal_ref())
            })
            .collect();
        let ids: Vec<_> = named.iter().map(|(_, id)| *id).collect();
        read.load_signals(&ids);
        let times = read.time_table().to_vec();
        let changes = named
            .into_iter()
            .map(|(name, id)| {
                let name = name.split_once('.').unwrap().1.to_owned();
                let signal = read.get_signal(id).unwrap();
                let mut changes: Vec<(u64, String)> = signal
                    .iter_changes()
                    .map(|(at, value)| (times[at as usize], value.to_string()))
                    .collect();
                changes.dedup_by(|next, last| next.1 == last.1);
                (name, changes)
            })
            .collect();
        Wave { changes, end: times.last().copied().unwrap_or_default() }
    }

    pub(crate) fn end(&self) -> u64 {
        self.end
    }

    fn of(&self, name: &str) -> &[(u64, String)] {
        assert!(self.changes.contains_key(name), "{name} in {:?}", self.changes.keys());
        &self.changes[name]
    }

    pub(crate) fn bits(&self, name: &str) -> Vec<(u64, bool)> {
        self.of(name).iter().map(|(at, value)| (*at, value == "1")).collect()
    }

    /// The times of the rising edges.
    pub(crate) fn edges(&self, name: &str) -> Vec<u64> {
        self.bits(name).into_iter().filter(|(_, high)| *high).map(|(at, _)| at).collect()
    }

    pub(crate) fn numbers(&self, name: &str) -> Vec<(u64, i64)> {
        let number = |value: &str| value.parse::<f64>().unwrap() as i64;
        self.of(name).iter().map(|(at, value)| (*at, number(value))).collect()
    }

    pub(crate) fn texts(&self, name: &str) -> Vec<(u64, String)> {
        let text = |value: &str| String::from_utf8(vimc4_device::unescape(value).unwrap()).unwrap();
        self.of(name).iter().map(|(at, value)| (*at, text(value))).collect()
    }
}
