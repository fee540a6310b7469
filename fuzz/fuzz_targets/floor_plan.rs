//! Any text as a floor plan: refused in one line, or a plan that survives writing.
#![no_main]

use libfuzzer_sys::fuzz_target;
use mobot_fuzz::one_line;
use monocal::FloorPlan;

fuzz_target!(|text: &str| {
    match FloorPlan::from_geojson(text) {
        Ok(plan) => {
            let again = FloorPlan::from_geojson(&plan.to_geojson()).expect("its own text");
            assert_eq!(again, plan);
        }
        Err(error) => one_line(&error),
    }
});
