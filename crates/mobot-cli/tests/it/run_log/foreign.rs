//! Other people's readers: the Python packages mcap, mcap-ros2-support and rosbags.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::seconds;

const PACKAGES: [&str; 3] = ["mcap==1.6.0", "mcap-ros2-support==0.6.0", "rosbags==0.11.9"];

/// Python with the packages, in a virtual environment of its own below the build's folder.
pub(super) fn python() -> Option<PathBuf> {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mcap-1.6.0-rosbags-0.11.9");
    let python = venv.join("bin/python");
    let has = || {
        let run = Command::new(&python)
            .args([
                "-c",
                "import mcap.reader, mcap_ros2.reader, rosbags.highlevel",
            ])
            .output();
        run.is_ok_and(|output| output.status.success())
    };
    if !has() {
        let made = Command::new("python3")
            .args(["-m", "venv"])
            .arg(&venv)
            .output();
        made.ok()?;
        let install = ["-m", "pip", "install", "--quiet"];
        Command::new(&python)
            .args(install)
            .args(PACKAGES)
            .output()
            .ok()?;
    }
    has().then_some(python)
}

fn run(script: &str, arguments: &[&Path]) -> Option<String> {
    let Some(python) = python() else {
        eprintln!("skipped: no Python 3 with venv, or {PACKAGES:?} cannot be installed");
        return None;
    };
    let run = Command::new(python)
        .args(["-c", script])
        .args(arguments)
        .output()
        .expect("Python runs");
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(
        run.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&run.stderr)
    );
    Some(said)
}

/// What both readers must find, in Python: written here from what `second` writes, not read back.
const CHECK: &str = r#"
import math, struct, zlib
START = 1795586400123456789
TYPES = {
    '/pose': 'geometry_msgs/msg/PoseWithCovarianceStamped', '/odom': 'nav_msgs/msg/Odometry',
    '/sonar': 'sensor_msgs/msg/Range', '/camera/image_raw/compressed': 'sensor_msgs/msg/CompressedImage',
    '/map': 'nav_msgs/msg/OccupancyGrid', '/plan': 'nav_msgs/msg/Path', '/tf': 'tf2_msgs/msg/TFMessage',
    '/rosout': 'rcl_interfaces/msg/Log', '/mobot/calls': 'mobot_msgs/msg/Call',
    '/mobot/decisions': 'mobot_msgs/msg/Decision', '/mobot/inputs': 'mobot_msgs/msg/Input',
}
COUNTS = {
    '/pose': 40, '/odom': 40, '/sonar': 40, '/camera/image_raw/compressed': 2, '/map': 2, '/plan': 2,
    '/tf': 80, '/rosout': 2, '/mobot/calls': 42, '/mobot/decisions': 40, '/mobot/inputs': 1,
}
def near(a, b): assert abs(a - b) < 1e-9, (a, b)
def stamp(t): return t.sec * 10**9 + t.nanosec
def flat(pose, x, y, yaw):
    near(pose.position.x, x); near(pose.position.y, y); near(pose.position.z, 0)
    q = pose.orientation
    near(q.x, 0); near(q.y, 0); near(q.z, math.sin(yaw / 2)); near(q.w, math.cos(yaw / 2))
def grey(png):
    assert bytes(png[:8]) == b'\x89PNG\r\n\x1a\n'
    return struct.unpack('>II', bytes(png[16:24]))
def check(topic, k, m):
    "The k-th message on a topic."
    now = 0.05 * k
    at = START + round(now * 1e9)
    if topic == '/pose':
        assert stamp(m.header.stamp) == at and m.header.frame_id == 'map'
        flat(m.pose.pose, 0.1 * now, -0.2, 0.3)
        c = list(m.pose.covariance)
        assert [c[0], c[1], c[6], c[7], c[35]] == [0.01, 0.001, 0.001, 0.02, 0.003] and sum(v != 0 for v in c) == 5
    elif topic == '/odom':
        assert stamp(m.header.stamp) == at and (m.header.frame_id, m.child_frame_id) == ('odom', 'base_link')
        flat(m.pose.pose, 0.1 * now, -0.2, 0.3)
        assert (m.twist.twist.linear.x, m.twist.twist.angular.z) == (0.1, 0.05)
    elif topic == '/sonar':
        assert stamp(m.header.stamp) == at - 30_000_000 and m.header.frame_id == 'sonar_link'
        assert m.radiation_type == 0
        assert abs(m.field_of_view - math.radians(18)) < 1e-7 and m.max_range == 5.0
        wanted = {1: math.inf, 2: -math.inf, 3: math.nan}.get(k % 20, 1.25)
        assert m.range == wanted or (math.isnan(m.range) and math.isnan(wanted))
    elif topic == '/camera/image_raw/compressed':
        assert m.format == 'png' and grey(m.data) == (24, 10)
    elif topic == '/map':
        assert (m.info.width, m.info.height) == (3, 2) and abs(m.info.resolution - 0.05) < 1e-8
        assert list(m.data) == [-1, 73, 27, 98, -1, 2]
        flat(m.info.origin, -1, 2, 0.5)
    elif topic == '/plan':
        flat(m.poses[0].pose, 0, 0, math.pi / 4); flat(m.poses[1].pose, 1, 1, math.pi / 4)
    elif topic == '/tf':
        t = m.transforms[0]
        if k % 2 == 0:
            assert (t.header.frame_id, t.child_frame_id) == ('map', 'base_link')
            near(t.transform.translation.x, 0.1 * 0.05 * (k // 2)); near(t.transform.rotation.z, math.sin(0.15))
        else:
            assert (t.header.frame_id, t.child_frame_id) == ('base_link', 'sonar_link')
            near(t.transform.rotation.z, math.sin(0.25))
    elif topic == '/rosout':
        assert (m.level, m.name, m.msg) == (30, 'stop', 'obstacle 0.3 m ahead \u2014 gr\u00fcn')
    elif topic == '/mobot/calls':
        assert (m.asked, list(m.arguments)) in [('ping', [0.5]), ('frame', [])]
    elif topic == '/mobot/decisions':
        assert (m.kind, m.time, list(m.numbers)) == ('command', now, [0.1, 0.05])
    elif topic == '/mobot/inputs':
        assert m.name == 'job.json' and bytes(m.data) == b'{}'
"#;

fn log(seconds_long: u32) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a file");
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, seconds(seconds_long)).expect("a file");
    (folder, path)
}

#[test]
fn mcap_and_its_ros2_support_read_every_value() {
    let (_folder, path) = log(2);
    let script = format!(
        "{CHECK}
import sys
from mcap.reader import make_reader, SeekingReader
from mcap_ros2.decoder import DecoderFactory
with open(sys.argv[1], 'rb') as f:
    reader = make_reader(f, validate_crcs=True, decoder_factories=[DecoderFactory()])
    assert isinstance(reader, SeekingReader)
    assert reader.get_header().profile == 'ros2'
    s = reader.get_summary()
    assert s.statistics.message_count == sum(COUNTS.values())
    assert s.statistics.chunk_count == len(s.chunk_indexes) >= 8
    assert {{c.topic: s.statistics.channel_message_counts[c.id] for c in s.channels.values()}} == COUNTS
    seen = dict.fromkeys(COUNTS, 0)
    last = 0
    for schema, channel, message, m in reader.iter_decoded_messages():
        assert schema.name == TYPES[channel.topic], schema.name
        assert message.log_time >= last
        last = message.log_time
        check(channel.topic, seen[channel.topic], m)
        seen[channel.topic] += 1
    assert seen == COUNTS, seen
    # by index: half of the time
    half = [m.log_time for _, _, m in reader.iter_messages(topics=['/pose'], start_time=START + 10**9)]
    assert len(half) == 20 and min(half) == START + 10**9
print('told', sum(seen.values()))
"
    );
    if let Some(said) = run(&script, &[&path]) {
        assert_eq!(said.trim(), "told 291");
    }
}

#[test]
fn rosbags_reads_every_value() {
    let (_folder, path) = log(2);
    let script = format!(
        "{CHECK}
import sys, pathlib
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
seen = dict.fromkeys(COUNTS, 0)
with AnyReader([pathlib.Path(sys.argv[1])]) as reader:
    assert {{c.topic: c.msgtype for c in reader.connections}} == TYPES
    for connection, time, raw in reader.messages():
        m = reader.deserialize(raw, connection.msgtype)
        check(connection.topic, seen[connection.topic], m)
        seen[connection.topic] += 1
    assert seen == COUNTS, seen
    # by ROS 2 Jazzy's own definitions, not by those in the file
    jazzy = get_typestore(Stores.ROS2_JAZZY)
    seen = dict.fromkeys(COUNTS, 0)
    for connection, time, raw in reader.messages():
        if not connection.topic.startswith('/mobot'):
            m = jazzy.deserialize_cdr(raw, connection.msgtype)
            check(connection.topic, seen[connection.topic], m)
            assert bytes(jazzy.serialize_cdr(m, connection.msgtype)) == bytes(raw), connection.topic
            seen[connection.topic] += 1
print('told', sum(seen.values()))
"
    );
    if let Some(said) = run(&script, &[&path]) {
        assert_eq!(said.trim(), "told 208");
    }
}

#[test]
fn a_cut_file_gives_mcap_s_stream_reader_every_whole_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let bytes = seconds(3);
    std::fs::write(&path, &bytes).unwrap();
    let script = "
import sys, io, random
from mcap.stream_reader import StreamReader
from mcap.records import Message
whole = open(sys.argv[1], 'rb').read()
def messages(data):
    found = []
    try:
        for record in StreamReader(io.BytesIO(data), validate_crcs=True).records:
            if isinstance(record, Message):
                found.append((record.channel_id, record.sequence, record.log_time))
    except Exception as e:
        return found, type(e).__name__
    return found, None
every, error = messages(whole)
assert error is None and len(every) > 400
dice = random.Random(1)
for length in [dice.randrange(len(whole)) for _ in range(1000)] + [len(whole) - k for k in range(1, 60)]:
    found, error = messages(whole[:length])
    assert error is not None and found == every[:len(found)]
    print(length, len(found))
";
    let Some(said) = run(script, &[&path]) else {
        return;
    };
    // their reader and ours find the same number
    let mut compared = 0;
    for line in said.lines() {
        let (length, found) = line.split_once(' ').unwrap();
        let (length, found): (usize, usize) = (length.parse().unwrap(), found.parse().unwrap());
        let ours = super::entries(&bytes[..length]).len();
        assert_eq!(ours, found, "cut at {length}");
        compared += 1;
    }
    assert_eq!(compared, 1059);
}
