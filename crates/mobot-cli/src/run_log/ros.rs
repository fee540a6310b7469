//! The ROS 2 messages of a run log, field by field, as ROS 2 Jazzy defines them.

use mobot_hw::Twist2;
use occgrid::Pose2;

use super::cdr::{Cdr, ros_message};

/// A message that has a topic in a run log.
pub trait Topic: Cdr {
    /// Where it goes.
    const TOPIC: &'static str;
    /// Its type's full name.
    const TYPE: &'static str;
}

macro_rules! topics {
    ($($message:ty: $name:literal on $topic:literal),* $(,)?) => {$(
        impl $crate::run_log::ros::Topic for $message {
            const TOPIC: &'static str = $topic;
            const TYPE: &'static str = $name;
        }
    )*};
}

pub(crate) use topics;

ros_message!(
    /// Wall time.
    Time = "builtin_interfaces/Time" {
        sec: i32,
        nanosec: u32,
    }
);

impl Time {
    /// Of nanoseconds since 1970; as late as it can tell after 2038.
    #[must_use]
    pub fn of(nanoseconds: u64) -> Self {
        let sec = nanoseconds / 1_000_000_000;
        Self {
            sec: i32::try_from(sec).unwrap_or(i32::MAX),
            nanosec: (nanoseconds % 1_000_000_000) as u32,
        }
    }
}

ros_message!(
    /// When, and in which frame.
    Header = "std_msgs/Header" {
        stamp: Time,
        frame_id: String,
    }
);

ros_message!(
    /// [m]
    Point = "geometry_msgs/Point" { x: f64, y: f64, z: f64 }
);

ros_message!(
    /// [m], [m/s] or [rad/s]
    Vector3 = "geometry_msgs/Vector3" { x: f64, y: f64, z: f64 }
);

ros_message!(
    /// A rotation.
    Quaternion = "geometry_msgs/Quaternion" { x: f64, y: f64, z: f64, w: f64 }
);

impl Quaternion {
    /// About the vertical [rad].
    #[must_use]
    pub fn of_yaw(yaw: f64) -> Self {
        let (z, w) = (yaw / 2.0).sin_cos();
        Self {
            x: 0.0,
            y: 0.0,
            z,
            w,
        }
    }

    /// About the vertical, -pi to pi [rad].
    #[must_use]
    pub fn yaw(&self) -> f64 {
        2.0 * f64::atan2(self.z, self.w)
    }
}

ros_message!(
    /// A place and a rotation.
    Pose = "geometry_msgs/Pose" {
        position: Point,
        orientation: Quaternion,
    }
);

impl Pose {
    /// On the floor.
    #[must_use]
    pub fn of(pose: Pose2) -> Self {
        Self {
            position: Point {
                x: pose.x,
                y: pose.y,
                z: 0.0,
            },
            orientation: Quaternion::of_yaw(pose.theta),
        }
    }

    /// What of it is on the floor.
    #[must_use]
    pub fn flat(&self) -> Pose2 {
        let yaw = self.orientation.yaw();
        Pose2::new(self.position.x, self.position.y, yaw)
    }
}

ros_message!(
    /// Covariance row by row: x, y, z, and rotations about them.
    PoseWithCovariance = "geometry_msgs/PoseWithCovariance" {
        pose: Pose,
        covariance: [f64; 36],
    }
);

/// Rows and columns of x, y and yaw among six.
const FLAT: [usize; 3] = [0, 1, 5];

impl PoseWithCovariance {
    /// On the floor; covariance of x, y, theta.
    #[must_use]
    pub fn of(pose: Pose2, covariance: &[[f64; 3]; 3]) -> Self {
        let mut full = [0.0; 36];
        for (row, values) in FLAT.iter().zip(covariance) {
            for (col, value) in FLAT.iter().zip(values) {
                full[row * 6 + col] = *value;
            }
        }
        Self {
            pose: Pose::of(pose),
            covariance: full,
        }
    }

    /// Covariance of x, y, theta.
    #[must_use]
    pub fn flat(&self) -> [[f64; 3]; 3] {
        FLAT.map(|row| FLAT.map(|col| self.covariance[row * 6 + col]))
    }
}

ros_message!(
    /// A velocity.
    Twist = "geometry_msgs/Twist" {
        linear: Vector3,
        angular: Vector3,
    }
);

impl Twist {
    /// Of a base.
    #[must_use]
    pub fn of(twist: Twist2) -> Self {
        let along = |x: f64, z: f64| Vector3 { x, y: 0.0, z };
        Self {
            linear: along(twist.linear, 0.0),
            angular: along(0.0, twist.angular),
        }
    }
}

ros_message!(
    /// Covariance as that of a pose.
    TwistWithCovariance = "geometry_msgs/TwistWithCovariance" {
        twist: Twist,
        covariance: [f64; 36],
    }
);

ros_message!(
    /// Where the robot is thought to be.
    PoseWithCovarianceStamped = "geometry_msgs/PoseWithCovarianceStamped" {
        header: Header,
        pose: PoseWithCovariance,
    }
);

ros_message!(
    /// Where the wheels have carried it.
    Odometry = "nav_msgs/Odometry" {
        header: Header,
        child_frame_id: String,
        pose: PoseWithCovariance,
        twist: TwistWithCovariance,
    }
);

ros_message!(
    /// One firing of the sonar: minus infinity for too close, infinity for no echo, NaN for a fault
    /// (REP-117).
    Range = "sensor_msgs/Range" {
        header: Header,
        radiation_type: u8,
        field_of_view: f32,
        min_range: f32,
        max_range: f32,
        range: f32,
        variance: f32,
    }
);

ros_message!(
    /// A pose at a time.
    PoseStamped = "geometry_msgs/PoseStamped" {
        header: Header,
        pose: Pose,
    }
);

ros_message!(
    /// A way.
    Path = "nav_msgs/Path" {
        header: Header,
        poses: Vec<PoseStamped>,
    }
);

ros_message!(
    /// Size and place of a map.
    MapMetaData = "nav_msgs/MapMetaData" {
        map_load_time: Time,
        resolution: f32,
        width: u32,
        height: u32,
        origin: Pose,
    }
);

ros_message!(
    /// Probabilities in percent, -1 unknown; the lowest row first.
    OccupancyGrid = "nav_msgs/OccupancyGrid" {
        header: Header,
        info: MapMetaData,
        data: Vec<i8>,
    }
);

ros_message!(
    /// A picture.
    CompressedImage = "sensor_msgs/CompressedImage" {
        header: Header,
        format: String,
        data: Vec<u8>,
    }
);

ros_message!(
    /// A place and a rotation, as a change of frames.
    Transform = "geometry_msgs/Transform" {
        translation: Vector3,
        rotation: Quaternion,
    }
);

ros_message!(
    /// A frame in another at a time.
    TransformStamped = "geometry_msgs/TransformStamped" {
        header: Header,
        child_frame_id: String,
        transform: Transform,
    }
);

ros_message!(
    /// Frames.
    TFMessage = "tf2_msgs/TFMessage" { transforms: Vec<TransformStamped> }
);

ros_message!(
    /// A line of a log.
    Log = "rcl_interfaces/Log" {
        stamp: Time,
        level: u8,
        name: String,
        msg: String,
        file: String,
        function: String,
        line: u32,
    }
);

topics!(
    PoseWithCovarianceStamped: "geometry_msgs/msg/PoseWithCovarianceStamped" on "/pose",
    Odometry: "nav_msgs/msg/Odometry" on "/odom",
    Range: "sensor_msgs/msg/Range" on "/sonar",
    Path: "nav_msgs/msg/Path" on "/plan",
    OccupancyGrid: "nav_msgs/msg/OccupancyGrid" on "/map",
    CompressedImage: "sensor_msgs/msg/CompressedImage" on "/camera/image_raw/compressed",
    TFMessage: "tf2_msgs/msg/TFMessage" on "/tf",
    Log: "rcl_interfaces/msg/Log" on "/rosout",
);
