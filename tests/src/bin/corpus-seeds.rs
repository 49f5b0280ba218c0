//! Writes the inputs that fuzzing begins with into `fuzz/corpus`, which is not kept.

use std::path::Path;
use std::{fs, io};

use vimc4_tests::fuzzing::seeds;

fn main() -> io::Result<()> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus");
    for seed in seeds::seeds() {
        let folder = corpus.join(seed.target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(seed.name), seed.data)?;
    }
    Ok(())
}
