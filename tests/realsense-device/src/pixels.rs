//! Pixels that the library borrows.

use core::ffi::c_void;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// Pixels in use by the library, by their address.
static LENT: Mutex<Option<HashMap<usize, Vec<u8>>>> = Mutex::new(None);

/// Keeps `pixels` until the library gives them back. Returns their address.
pub(crate) fn lend(mut pixels: Vec<u8>) -> *mut c_void {
    let address = pixels.as_mut_ptr();
    let mut lent = LENT.lock().unwrap_or_else(PoisonError::into_inner);
    lent.get_or_insert_default().insert(address.addr(), pixels);
    address.cast()
}

/// Frees the pixels at `address`, which the library gives back.
pub(crate) unsafe extern "C" fn give_back(address: *mut c_void) {
    let mut lent = LENT.lock().unwrap_or_else(PoisonError::into_inner);
    lent.get_or_insert_default().remove(&address.addr());
}
