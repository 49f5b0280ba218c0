//! Writes the inputs that fuzzing begins with into the corpus, `fixtures/corpus`.

use std::{fs, io};

use vimc4_tests::fuzzing::{folder, seeds};

fn main() -> io::Result<()> {
    for seed in seeds::seeds() {
        let folder = folder().join(seed.target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(seed.name), seed.data)?;
    }
    Ok(())
}
