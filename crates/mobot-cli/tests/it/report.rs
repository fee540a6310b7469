//! The page about a mission: whole in itself, safe against hostile names, and alive in a real browser.

use std::path::Path;
use std::process::Command;

use mobot_cli::report::{Figure, Frame, Moment, Report, Sweep};
use occgrid::{LoadOptions, OccupancyMap, Point2, Pose2, Reading, load_map};

fn map() -> OccupancyMap {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata/maps/cob_environments/ipa-apartment/map.yaml");
    load_map(path, &LoadOptions::default()).expect("a map").map
}

fn moments() -> Vec<Moment> {
    (0..400)
        .map(|i| {
            let t = f64::from(i) * 0.25;
            let at = |off: f64| Pose2::new(0.02 * t + off, 0.5 * (t / 20.0).sin() + off, t / 40.0);
            Moment {
                time: t,
                estimate: at(0.005 * (t * 3.0).sin()),
                bound: 0.02 + 0.01 * (t / 9.0).sin().abs(),
                odometry: at(0.004 * t),
                truth: Some(at(0.0)),
            }
        })
        .collect()
}

fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    image::GrayImage::from_fn(48, 22, |x, y| image::Luma([(x * 4 + y) as u8]))
        .write_to(
            &mut std::io::Cursor::new(&mut bytes),
            image::ImageFormat::Png,
        )
        .expect("a picture");
    bytes
}

fn page(map: &OccupancyMap) -> String {
    let report = Report {
        title: "office </title><script>alert(1)</script>".to_owned(),
        outcome: "Reached its goal & came back.".to_owned(),
        tiles: vec![
            ("14.2 m".into(), "driven".into(), None),
            ("0".into(), "contacts".into(), Some(true)),
            ("5.1 cm".into(), "largest error".into(), Some(false)),
        ],
        map,
        walls: vec![vec![Point2::new(-1.0, -1.0), Point2::new(2.0, -1.0)]],
        roadmap: vec![vec![Point2::new(-1.0, 0.0), Point2::new(2.0, 1.0)]],
        routes: vec![vec![Point2::new(0.0, 0.0), Point2::new(2.0, 0.5)]],
        radius: 0.2,
        moments: moments(),
        events: vec![
            (0.0, "go".into(), false),
            (31.5, "stop: obstacle 0.30 m ahead <b>".into(), true),
            (99.0, "arrived".into(), false),
        ],
        frames: vec![Frame {
            time: 30.0,
            png: png(),
            caption: "3 floor edges, 2 door corners".into(),
        }],
        sweeps: vec![Sweep {
            time: 5.0,
            soundings: (0..20)
                .map(|i| {
                    let reading = match i % 4 {
                        0 => Reading::NoEcho { listened: 5.0 },
                        _ => Reading::Echo {
                            range: 1.0 + f64::from(i % 7) * 0.4,
                        },
                    };
                    (f64::from(i) * 0.314, reading)
                })
                .collect(),
        }],
        figures: vec![Figure {
            what: "largest error while driving".into(),
            ours: "5.1 cm".into(),
            bar: "4.7 cm".into(),
            paper: "4.7 cm".into(),
            met: Some(false),
        }],
    };
    report.html().expect("a page")
}

#[test]
fn the_page_needs_nothing_beside_it_and_names_cannot_leave_their_place() {
    let page = page(&map());
    for outside in [
        "src=\"http",
        "href=\"http",
        "src=\"//",
        "url(http",
        "@import",
    ] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert(1)"));
    assert!(page.contains("0.30 m ahead &lt;b&gt;"));
    assert_eq!(page.matches("</html>").count(), 1);
}

/// The browser's own view: the page's script ran without a word of complaint, and moved things.
#[test]
fn a_real_browser_shows_the_page_and_its_script_runs() {
    let Some(browser) = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok())
    else {
        println!("no Chromium: not looked at in a browser");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("report.html");
    std::fs::write(&file, page(&map())).expect("written");
    let shown = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            "--virtual-time-budget=3000",
            "--dump-dom",
        ])
        .arg(format!(
            "--user-data-dir={}",
            folder.path().join("profile").display()
        ))
        .arg(format!("file://{}", file.display()))
        .output()
        .expect("a browser that runs");
    let (dom, words) = (
        String::from_utf8_lossy(&shown.stdout),
        String::from_utf8_lossy(&shown.stderr),
    );
    let complaints: Vec<&str> = words
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(complaints.is_empty(), "{complaints:?}");
    // the script wrote the last moment's error, put three robots on the map, and marked frame and event
    assert!(dom.contains("99.8 s: error"), "{words}");
    assert_eq!(dom.matches("fill-opacity=\"0.25\"").count(), 3);
    assert!(dom.contains("<tr data-t=\"99.000\" class=\"now\">"));
    assert!(dom.contains("class=\"cursor\""));
}
