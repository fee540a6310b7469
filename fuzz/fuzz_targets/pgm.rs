//! Any bytes as a PGM: refused, or a picture that survives being written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use occgrid::{PgmEncoding, PgmLimits, read_pgm};

fuzz_target!(|data: &[u8]| {
    let limits = PgmLimits {
        max_pixels: 1 << 16,
        ..PgmLimits::default()
    };
    let Ok(image) = read_pgm(data, &limits) else {
        return;
    };
    for encoding in [PgmEncoding::Ascii, PgmEncoding::Binary] {
        let mut bytes = Vec::new();
        image
            .write(encoding, &mut bytes)
            .expect("a Vec takes every byte");
        let again = read_pgm(bytes.as_slice(), &limits).expect("what was written");
        assert_eq!(again, image);
    }
});
