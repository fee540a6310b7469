//! `mobot devices`, and what device URIs it takes.

use serde_json::Value;

use crate::run::{Run, mobot, testdata};

fn asked<const N: usize>(arguments: [&str; N]) -> (i32, Value) {
    let run = mobot(["devices", "--json"].into_iter().chain(arguments));
    (run.status, run.json())
}

#[test]
fn without_names_it_lists_and_asks_nobody() {
    let (status, answer) = asked([]);
    assert_eq!(status, 0);
    assert_eq!(answer["devices"], Value::Array(Vec::new()));
    assert!(answer["ports"].is_array() && answer["cameras"].is_array());
    let text = mobot(["devices"]);
    assert_eq!(text.status, 0);
    assert!(text.stdout.contains("name devices to ask them"));
}

#[test]
fn a_simulated_robot_answers_like_a_real_one() {
    let (status, answer) = asked(["sim:"]);
    assert_eq!(status, 0, "{answer}");
    let devices = answer["devices"].as_array().expect("a list");
    let kinds: Vec<&str> = devices.iter().flat_map(|d| d["kind"].as_str()).collect();
    assert_eq!(kinds, ["base", "sonar", "camera"]);
    for device in devices {
        assert_eq!(device["ok"], true, "{device}");
        assert_eq!(device["uri"], "sim:");
    }
    assert!(
        devices[2]["reading"]
            .as_str()
            .unwrap()
            .starts_with("480 x 220 px")
    );
    let camera = devices[2]["rate_hz"].as_f64().expect("a rate");
    assert!((10.0..=30.1).contains(&camera), "{camera}");
}

#[test]
fn what_is_not_there_is_no_and_says_why() {
    let (status, answer) = asked(["--base", "create2:/dev/none", "ff:/dev/null"]);
    assert_eq!(status, 1);
    let devices = answer["devices"].as_array().expect("a list");
    for device in devices {
        assert_eq!(device["ok"], false, "{device}");
        assert!(device["error"].as_str().is_some_and(|e| !e.is_empty()));
    }
    let error = |k: usize| devices[k]["error"].as_str().unwrap_or_default();
    // named with a flag, so asked last
    assert!(error(1).contains("/dev/none"), "{}", error(1));
    assert!(error(0).contains("/dev/null"), "{}", error(0));
}

#[test]
fn a_stream_of_pictures_is_a_camera() {
    let stream = testdata("golden/stream.mjpeg");
    let uri = format!("mjpeg:{}", stream.display());
    let (status, answer) = asked([uri.as_str()]);
    assert_eq!(status, 0, "{answer}");
    let device = &answer["devices"][0];
    assert_eq!(device["kind"], "camera");
    let reading = device["reading"].as_str().expect("a reading");
    assert!(reading.contains(" px, mean level "), "{reading}");
}

/// Status 2 and one line that holds all of these words.
fn refused(run: &Run, words: &[&str]) {
    assert_eq!(run.status, 2, "{}{}", run.stdout, run.stderr);
    assert_eq!(run.stderr.lines().count(), 1, "one line: {}", run.stderr);
    assert_eq!(run.stdout, "");
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} not in {}", run.stderr);
    }
}

#[test]
fn uris_that_make_no_sense_are_refused_in_one_line() {
    let positional: [(&str, &[&str]); 8] = [
        ("/dev/ttyUSB0", &["expected create2:PORT", "/dev/ttyUSB0"]),
        ("maxbotix", &["maxbotix", "expected a port", "\"\""]),
        ("maxbotix:", &["expected a port"]),
        (
            "maxbotix:/dev/x?model=",
            &["model", "expected lv, xl", "\"\""],
        ),
        (
            "maxbotix:/dev/x?mount=1,2",
            &["mount", "X,Y,YAW", "\"1,2\""],
        ),
        ("maxbotix:/dev/x?mount=1,2,nan", &["mount", "X,Y,YAW"]),
        (
            "create2:/dev/x?model=lv",
            &["expected options baud, max_speed", "model"],
        ),
        (
            "srf02:/dev/x?address=16",
            &["address", "expected 0 to 15", "\"16\""],
        ),
    ];
    for (uri, words) in positional {
        refused(&mobot(["devices", uri]), words);
    }
    let flagged: [(&str, &str, &[&str]); 9] = [
        ("--base", "create2:/dev/x?baud=0", &["baud", "1 or more"]),
        (
            "--base",
            "maxbotix:/dev/x",
            &["expected sim:, create2:PORT"],
        ),
        (
            "--base",
            "sim:office",
            &["expected nothing after the colon", "office"],
        ),
        ("--base", "record:x", &["record", "expected FILE,DEVICE"]),
        ("--sonar", "ff:/dev/x?baud=0", &["baud", "1 or more"]),
        ("--sonar", "ff:/dev/x?ask", &["key=value", "\"ask\""]),
        ("--sonar", "ff:/dev/x?ask=true&ask=false", &["given once"]),
        ("--turret", "maestro:/dev/x?sign=2", &["sign", "1 or -1"]),
        (
            "--camera",
            "v4l2:/dev/video0?size=640",
            &["size", "WIDTHxHEIGHT"],
        ),
    ];
    for (flag, uri, words) in flagged {
        refused(&mobot(["devices", flag, uri]), words);
    }
}
