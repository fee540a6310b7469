//! Sonar logs: what is read, what is refused and how, what is written.

use std::fmt::Write as _;

use occgrid::{
    LOG_HEADER, LogError, LogLimits, Pose2, Reading, ReadingCounts, Shot, read_log,
    read_log_within, write_log,
};
use proptest::prelude::*;

#[test]
fn every_kind_is_read() {
    let text = format!(
        "\u{feff}{LOG_HEADER}\r\n0.5,1,2,0.25,-1.5,echo,2.5\r\n1,0,0,0,0,no_echo,5\r\n\r\n\
         2,0,0,0,0,too_close,\r\n3,0,0,0,0,fault,0.1"
    );
    let shots = read_log(text.as_bytes()).expect("a good log");
    let expected = Shot {
        stamp: 0.5,
        map_from_base: Pose2::new(1.0, 2.0, 0.25),
        bearing: -1.5,
        reading: Reading::Echo { range: 2.5 },
    };
    assert_eq!(shots[0], expected);
    assert_eq!(shots[1].reading, Reading::NoEcho { listened: 5.0 });
    let counts = ReadingCounts::of(&shots);
    assert_eq!(
        counts,
        ReadingCounts {
            echo: 1,
            no_echo: 1,
            too_close: 1,
            fault: 1
        }
    );
    assert!(
        read_log(format!("{LOG_HEADER}\n").as_bytes())
            .expect("no shots")
            .is_empty()
    );
}

#[test]
fn errors_name_line_column_expected_and_found() {
    let cases = [
        ("", "line 1: expected the header"),
        ("a,b\n", "found \"a,b\""),
        ("H\n1,2,3\n", "line 2: expected 7 fields"),
        ("H\n1,2,3,4,5,echo,1,2\n", "found 8"),
        (
            "H\n\n0,nan,0,0,0,echo,1\n",
            "line 3, column x: expected a finite number, found \"nan\"",
        ),
        ("H\n0,0,0,0,inf,echo,1\n", "line 2, column bearing"),
        ("H\n0,0,0,1e999,0,echo,1\n", "line 2, column theta"),
        (
            "H\n0,0,0,0,0,echo,-1\n",
            "line 2, column range: expected a finite number of metres",
        ),
        ("H\n0,0,0,0,0,echo,\n", "column range"),
        ("H\n0,0,0,0,0,no_echo,NaN\n", "column range"),
        ("H\n0,0,0,0,0,fault,x\n", "column range"),
        (
            "H\n0,0,0,0,0,bang,1\n",
            "column kind: expected echo, no_echo, too_close or fault",
        ),
    ];
    for (text, expected) in cases {
        let text = text.replacen('H', LOG_HEADER, 1);
        let message = read_log(text.as_bytes()).expect_err(&text).to_string();
        assert!(message.contains(expected), "{text:?}: {message}");
    }
}

#[test]
fn limits_hold() {
    let line = "0,0,0,0,0,echo,1\n";
    let text = format!("{LOG_HEADER}\n{}", line.repeat(10));
    let within = |max_bytes, max_shots| {
        read_log_within(
            text.as_bytes(),
            LogLimits {
                max_bytes,
                max_shots,
            },
        )
    };
    let bytes = text.len() as u64;
    assert_eq!(within(bytes, 10).expect("just fits").len(), 10);
    assert!(matches!(
        within(bytes - 1, 10),
        Err(LogError::TooLong { line: 11, .. })
    ));
    assert!(matches!(
        within(bytes, 9),
        Err(LogError::TooLong { line: 11, .. })
    ));
    // a line without end, from a source without end
    assert!(matches!(
        read_log(std::io::repeat(b'7')),
        Err(LogError::Header { .. })
    ));
    let endless = std::io::Read::chain(LOG_HEADER.as_bytes(), &b"\n"[..]);
    let endless = std::io::Read::chain(endless, std::io::repeat(b'1'));
    assert!(matches!(
        read_log(endless),
        Err(LogError::TooLong { line: 2, .. })
    ));
    let blank = std::io::Read::chain(
        &b"stamp,x,y,theta,bearing,kind,range\n"[..],
        std::io::repeat(b'\n'),
    );
    assert!(matches!(
        read_log_within(
            blank,
            LogLimits {
                max_bytes: 1 << 16,
                max_shots: 9
            }
        ),
        Err(LogError::TooLong { .. })
    ));
}

#[test]
fn the_corridor_log_is_read() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../testdata/sonar/udacity-robond"
    );
    let file = std::fs::File::open(format!("{folder}/log.csv")).expect("the log is there");
    let shots = read_log(file).expect("a good log");
    let counts = ReadingCounts::of(&shots);
    // counted in the source: 413 stops of eight readings, 1068 of them 5110
    assert_eq!(
        (shots.len(), counts.echo, counts.no_echo),
        (8 * 413, 2236, 1068)
    );
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![
        -1e4..1e4,
        proptest::num::f64::NORMAL | proptest::num::f64::ZERO
    ]
}

fn shots() -> impl Strategy<Value = Vec<Shot>> {
    let reading = prop_oneof![
        finite().prop_map(|r| Reading::Echo { range: r.abs() }),
        finite().prop_map(|r| Reading::NoEcho { listened: r.abs() }),
        Just(Reading::TooClose),
        Just(Reading::Fault),
    ];
    let shot = (finite(), finite(), finite(), finite(), finite(), reading).prop_map(
        |(stamp, x, y, theta, bearing, reading)| Shot {
            stamp,
            map_from_base: Pose2::new(x, y, theta),
            bearing,
            reading,
        },
    );
    proptest::collection::vec(shot, 0..20)
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(shots in shots()) {
        let mut file = Vec::new();
        write_log(&mut file, &shots).expect("memory takes everything");
        prop_assert_eq!(read_log(&file[..]).expect("our own log"), shots);
    }

    #[test]
    fn no_text_makes_the_reader_panic(lines in proptest::collection::vec(".{0,40}", 0..5)) {
        let mut text = LOG_HEADER.to_owned();
        for line in lines {
            let _ = write!(text, "\n{line}");
        }
        let _ = read_log(text.as_bytes());
    }
}
