//! Whatever a caller hands over, nothing happens that must not: the inputs to begin with of the fuzz target
//! `capi`, whole, cut off anywhere, and with bytes changed.

mod inputs;

use inputs::inputs;

/// Every call, of both families, with what is right and what is wrong.
const SESSIONS: [&[u8]; 5] = [
    b"model=imc-s8\nmachine=mill\n\nw@07\r@0A5000,900,0,900,0,900,0,900\r\nux = 2500\nopress stop\n\
      uidle\nr16\np4\nv\nk\na1000000000\nb\nv\nc\nr1\nf\np0\nS1stop\nS0stop\nohelp\nofault cut\n\
      ofaults\nn\nnx",
    b"model=smcu\nmachine=board-plotter\nline_pacing=on\n\nwPR100,100;\nuidle\nr64\nv\n",
    b"model=imc4\nline_pacing=maybe\n",
    b"model\n\n",
    b"machine=no such\nwhat=ever\n\n",
];

#[test]
fn what_a_caller_hands_over_does_no_harm() {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || {
        // xorshift64
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed as usize
    };
    for session in SESSIONS {
        inputs(session);
        for _ in 0..100 {
            let mut data = session.to_vec();
            for _ in 0..random() % 4 {
                let at = random() % data.len();
                match random() % 3 {
                    0 => data[at] = random() as u8,
                    1 => drop(data.remove(at)),
                    _ => data.insert(at, data[random() % data.len()]),
                }
            }
            data.truncate(random() % (data.len() + 1) + data.len() / 2);
            inputs(&data);
        }
    }
}
