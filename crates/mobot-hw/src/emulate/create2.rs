//! A Create 2: modes, drive commands, packets asked for or streamed. The last drive command holds.

use super::{Emulator, RobotView};
use crate::serial::create2::{COUNT, MAX_MM_S, Mode};

/// A Create 2.
#[derive(Debug, Clone, Default)]
pub struct Create2Emulator {
    command: Vec<u8>,
    mode: Mode,
    /// Left and right [mm/s].
    wheels_mm_s: [i16; 2],
    stream: Vec<u8>,
    streaming: bool,
    next: f64,
}

/// How many bytes follow an opcode, as far as its data so far tell; `None` while that is open.
fn arguments(command: &[u8]) -> Option<usize> {
    let counted = |each: usize, at: usize| {
        let count = command.get(at)?;
        Some(at + usize::from(*count) * each)
    };
    Some(match command[0] {
        129 | 138 | 141 | 142 | 147 | 150 | 165 => 1,
        139 | 144 | 168 => 3,
        162 => 2,
        137 | 145 | 146 | 163 | 164 => 4,
        167 => 15,
        140 => return counted(2, 2),
        148 | 149 => return counted(1, 1),
        _ => 0,
    })
}

impl Create2Emulator {
    fn run(&mut self, robot: &RobotView, out: &mut Vec<u8>) {
        let command = std::mem::take(&mut self.command);
        let drives = matches!(self.mode, Mode::Safe | Mode::Full);
        match *command.as_slice() {
            [7 | 173] => self.enter(Mode::Off, robot),
            [128] => self.enter(Mode::Passive, robot),
            _ if self.mode == Mode::Off => {}
            [130 | 131] => self.mode = Mode::Safe,
            [132] => self.mode = Mode::Full,
            [133] => self.enter(Mode::Passive, robot),
            [145, rh, rl, lh, ll] if drives => {
                let [right, left] = [[rh, rl], [lh, ll]].map(i16::from_be_bytes);
                self.drive([left, right], robot);
            }
            [137, vh, vl, rh, rl] if drives => {
                let [speed, radius] = [[vh, vl], [rh, rl]].map(i16::from_be_bytes);
                self.drive(wheels_of(speed, radius), robot);
            }
            [146, rh, rl, lh, ll] if drives => {
                let [right, left] = [[rh, rl], [lh, ll]].map(|b| {
                    (i32::from(i16::from_be_bytes(b)).clamp(-255, 255) * 500 / 255) as i16
                });
                self.drive([left, right], robot);
            }
            [142, id] => self.packet(id, robot, out),
            [149, _, ref ids @ ..] => ids.iter().for_each(|id| self.packet(*id, robot, out)),
            [148, _, ref ids @ ..] => {
                self.stream = ids.to_vec();
                self.streaming = true;
                self.next = robot.now();
            }
            [150, on] => self.streaming = on == 1,
            _ => {}
        }
    }

    fn enter(&mut self, mode: Mode, robot: &RobotView) {
        self.mode = mode;
        self.drive([0; 2], robot);
        if mode == Mode::Off {
            self.streaming = false;
        }
    }

    fn drive(&mut self, wheels: [i16; 2], robot: &RobotView) {
        self.wheels_mm_s = wheels.map(|w| w.clamp(-MAX_MM_S, MAX_MM_S));
        robot.drive(self.wheels_mm_s.map(|w| f64::from(w) / 1000.0));
    }

    /// The data of a packet, or of all packets of a group.
    fn packet(&self, id: u8, robot: &RobotView, out: &mut Vec<u8>) {
        let group = match id {
            0 => 7..=26,
            1 => 7..=16,
            2 => 17..=20,
            3 => 21..=26,
            4 => 27..=34,
            5 => 35..=42,
            6 => 7..=42,
            100 => 7..=58,
            101 => 43..=58,
            106 => 46..=51,
            107 => 54..=58,
            _ => id..=id,
        };
        for id in group {
            let value = self.value(id, robot).to_be_bytes();
            match id {
                7..=18 | 21 | 24 | 32 | 34..=38 | 45 | 52 | 53 | 58 => out.push(value[1]),
                19..=57 => out.extend(value),
                _ => {}
            }
        }
    }

    fn value(&self, id: u8, robot: &RobotView) -> u16 {
        let [left, right] = self.wheels_mm_s;
        match id {
            7 => {
                let [bump_left, bump_right] = robot.bumped();
                let drops = if robot.wheel_drop() { 0b1100 } else { 0 };
                u16::from(bump_right) | u16::from(bump_left) << 1 | drops
            }
            9..=12 => robot.cliff().into(),
            22 => 16_000,
            24 => 25,
            25 => 2500,
            26 => 2700,
            35 => self.mode as u16,
            38 => self.stream.len() as u16,
            41 => right as u16,
            42 => left as u16,
            43 => robot.counts(COUNT)[0] as u16,
            44 => robot.counts(COUNT)[1] as u16,
            _ => 0,
        }
    }

    fn frame(&self, robot: &RobotView) -> Vec<u8> {
        let mut frame = vec![19, 0];
        for id in &self.stream {
            frame.push(*id);
            self.packet(*id, robot, &mut frame);
        }
        frame[1] = (frame.len() - 2) as u8;
        let sum = frame.iter().fold(0_u8, |sum, b| sum.wrapping_add(*b));
        frame.push(sum.wrapping_neg());
        frame
    }
}

/// Wheel speeds of a velocity and a radius [mm/s], [mm].
fn wheels_of(speed: i16, radius: i16) -> [i16; 2] {
    match radius {
        i16::MIN | i16::MAX => [speed; 2],
        -1 => [speed, speed.saturating_neg()],
        1 => [speed.saturating_neg(), speed],
        0 => [0; 2],
        _ => {
            let (v, r) = (f64::from(speed), f64::from(radius));
            [v * (r - 117.5) / r, v * (r + 117.5) / r].map(|w| w.round() as i16)
        }
    }
}

impl Emulator for Create2Emulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        let mut out = Vec::new();
        for byte in bytes {
            self.command.push(*byte);
            if arguments(&self.command).is_some_and(|n| self.command.len() > n) {
                self.run(robot, &mut out);
            }
        }
        let forward = self.wheels_mm_s.iter().map(|w| i32::from(*w)).sum::<i32>() > 0;
        if self.mode == Mode::Safe && (robot.wheel_drop() || robot.cliff() && forward) {
            self.enter(Mode::Passive, robot);
        }
        let now = robot.now();
        if self.streaming && now >= self.next {
            self.next = (self.next + 0.015).max(now);
            out.extend(self.frame(robot));
        }
        out
    }

    fn wheels(&self) -> Option<[f64; 2]> {
        Some(self.wheels_mm_s.map(|w| f64::from(w) / 1000.0))
    }
}
