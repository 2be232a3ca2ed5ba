//! x
#![no_std]
#![no_main]
use embassy_executor::Spawner;
#[panic_handler]
fn p(_: &core::panic::PanicInfo) -> ! { loop {} }
#[embassy_executor::main]
async fn main(_s: Spawner) { let _p = embassy_rp::init(Default::default()); }
