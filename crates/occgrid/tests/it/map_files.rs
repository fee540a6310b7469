//! Maps read as Nav2 reads them and written so that Nav2 reads back the same.

use occgrid::{LoadOptions, MapMode, SaveOptions, load_map, save_map};

#[test]
fn real_map_survives_saving() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/maps");
    let loaded = load_map(format!("{root}/nav2/depot.yaml"), &LoadOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("copy.yaml");
    let log_odds: Vec<f32> = loaded
        .map
        .values()
        .iter()
        .map(|&v| f32::from(v) / 3.0)
        .collect();
    for mode in [MapMode::Trinary, MapMode::Scale, MapMode::Raw] {
        let options = SaveOptions {
            mode,
            ..SaveOptions::default()
        };
        let saved = save_map(&path, &loaded.map, Some(&log_odds), &options).unwrap();
        assert_eq!(saved.notes, Vec::<String>::new());
        let again = load_map(&path, &LoadOptions::default()).unwrap();
        assert_eq!(again.map, loaded.map);
        assert_eq!(again.log_odds.as_deref(), Some(log_odds.as_slice()));
    }
}
