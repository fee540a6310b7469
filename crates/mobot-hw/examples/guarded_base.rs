//! A real base through its guard: half a metre a second at most, ten centimetres forwards, and back.
//!
//! `cargo run --features serial --example guarded_base -- create2 /dev/serial/by-id/usb-...`

// an example is there to print
#![allow(clippy::print_stdout)]

#[cfg(unix)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use mobot_hw::guard::BaseKind;
    use mobot_hw::serial::{ArduinoParams, Create2Params, KobukiParams, arduino, create2, kobuki};

    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (kind, baud) = match arguments.first().map(String::as_str) {
        // the program is its own guard
        Some("guard") => return Ok(mobot_hw::guard::run(arguments.into_iter().skip(1))?),
        Some("create2") => (BaseKind::Create2(Create2Params::default()), create2::BAUD),
        Some("kobuki") => (BaseKind::Kobuki(KobukiParams::default()), kobuki::BAUD),
        // check its track and its counts for a metre
        Some("arduino") => (BaseKind::Arduino(ArduinoParams::default()), arduino::BAUD),
        _ => {
            println!("guarded_base create2|kobuki|arduino PORT");
            return Ok(());
        }
    };
    let port = arguments.get(1).ok_or("which port?")?;
    unix::there_and_back(port, baud, &kind)
}

#[cfg(unix)]
mod unix {
    use mobot_hw::guard::{BaseKind, GuardedBase};
    use mobot_hw::{Clock as _, DifferentialDrive as _, SystemClock, Twist2};

    pub(crate) fn there_and_back(
        port: &str,
        baud: u32,
        kind: &BaseKind,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let mut clock = SystemClock::start();
        let executable = std::env::current_exe()?;
        let mut base = GuardedBase::spawn(&executable, port, baud, kind, clock)?;
        println!("{:?}", base.status()?);
        for speed in [0.1, -0.1] {
            for _ in 0..20 {
                base.drive(Twist2::new(speed, 0.0))?;
                clock.sleep(0.05);
                let status = base.status()?;
                if status.in_trouble() {
                    base.stop()?;
                    return Err(format!("stopped: {status:?}").into());
                }
            }
            base.stop()?;
            clock.sleep(0.5);
            println!("{:?}", base.status()?.travel);
        }
        Ok(())
    }
}

#[cfg(not(unix))]
fn main() {}
