//! Serial protocols: bytes from the makers' documents, damaged streams, silent and vanishing ports.

mod asked;
mod battery;
mod ff;
mod maestro;
mod maxbotix;
mod rig;
mod urm37;
