//! The program for C, and for what calls C (Julia, MATLAB, Fortran): commands as at the terminal, answers as JSON, datasets of files as arrays. `signorini.h` is the header.
//!
//! Every pointer that a function takes is one that C gives: a text that ends with a zero byte, or what another function here returned. Nothing is thrown, and nothing unwinds
//! into the caller.

use std::ffi::{CStr, CString, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::ptr::null_mut;
use std::sync::Arc;

use signorini::cli::{self, Call, Desk};
use signorini::store::{self, Raw};

/// Dimensions that an array may have.
const RANK: usize = 8;

/// What a command answered.
#[derive(Debug)]
pub struct Answer {
    code: c_int,
    json: CString,
    message: CString,
    warnings: CString,
}

/// A dataset: numbers row by row.
#[repr(C)]
#[derive(Debug)]
pub struct Array {
    rank: usize,
    shape: [usize; RANK],
    size: usize,
    data: *mut f64,
}

/// A text for C: it ends at its first zero byte.
fn text(of: impl Into<Vec<u8>>) -> CString {
    let mut bytes = of.into();
    bytes.retain(|b| *b != 0);
    CString::new(bytes).unwrap_or_default()
}

/// The text that a pointer leads to; none where it is no Unicode.
///
/// # Safety
/// `pointer` is a text of C, or null.
unsafe fn read<'a>(pointer: *const c_char) -> Option<&'a str> {
    match pointer.is_null() {
        true => None,
        // SAFETY: a text of C, by the contract of the header
        false => unsafe { CStr::from_ptr(pointer) }.to_str().ok(),
    }
}

fn carried_out(arguments: Vec<String>) -> Answer {
    let desk = Arc::new(Desk::default());
    let done = cli::call(Call { arguments, scene: None, is_scratch: false }, desk.clone());
    let warnings = text(desk.warnings().join("\n"));
    match done {
        Ok(answer) => {
            let message = answer.failure.clone().unwrap_or_default();
            let code = if message.is_empty() { 0 } else { 3 };
            Answer {
                code,
                json: text(answer.object().to_string()),
                message: text(message),
                warnings,
            }
        }
        Err(e) => {
            Answer { code: e.exit_code().into(), json: text(""), message: text(e.text()), warnings }
        }
    }
}

/// The version of the program.
#[unsafe(no_mangle)]
pub extern "C" fn signorini_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Carry a command out: its arguments as at the terminal, without the program's name.
///
/// # Safety
/// `arguments` leads to `count` texts of C.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_call(
    arguments: *const *const c_char,
    count: usize,
) -> *mut Answer {
    // SAFETY: so many pointers, by the contract of the header
    let words = (0..count).map(|k| unsafe { read(*arguments.add(k)) }.map(str::to_owned));
    let answer = match words.collect::<Option<Vec<String>>>() {
        None => Answer {
            code: 2,
            json: text(""),
            message: text("an argument is null, or no UTF-8"),
            warnings: text(""),
        },
        Some(words) => {
            catch_unwind(AssertUnwindSafe(|| carried_out(words))).unwrap_or_else(|_| Answer {
                code: 101,
                json: text(""),
                message: text("the command ended abnormally; please report it"),
                warnings: text(""),
            })
        }
    };
    Box::into_raw(Box::new(answer))
}

/// The exit code that the command would have at the terminal.
///
/// # Safety
/// `answer` is one of [`signorini_call`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_code(answer: *const Answer) -> c_int {
    // SAFETY: as said
    unsafe { (*answer).code }
}

/// Its answer as JSON; empty where there is none.
///
/// # Safety
/// `answer` is one of [`signorini_call`]; the text lives as long.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_json(answer: *const Answer) -> *const c_char {
    // SAFETY: as said
    unsafe { (*answer).json.as_ptr() }
}

/// Why it failed; empty where it did not.
///
/// # Safety
/// As of [`signorini_json`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_message(answer: *const Answer) -> *const c_char {
    // SAFETY: as said
    unsafe { (*answer).message.as_ptr() }
}

/// What a user should know, a line each.
///
/// # Safety
/// As of [`signorini_json`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_warnings(answer: *const Answer) -> *const c_char {
    // SAFETY: as said
    unsafe { (*answer).warnings.as_ptr() }
}

/// Give an answer back.
///
/// # Safety
/// `answer` is one of [`signorini_call`], or null, and not used any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_free(answer: *mut Answer) {
    if !answer.is_null() {
        // SAFETY: as said
        drop(unsafe { Box::from_raw(answer) });
    }
}

fn numbers(path: &Path, name: &str) -> Result<(Vec<usize>, Vec<f64>), String> {
    let raw = store::read_raw(path, name).map_err(|e| e.to_string())?;
    let shape = |s: &[usize]| match s.len() <= RANK {
        true => Ok(s.to_vec()),
        false => Err(format!("{name} has more than {RANK} dimensions")),
    };
    Ok(match raw {
        Raw::Float(a) => (shape(a.shape())?, a.iter().copied().collect()),
        Raw::Integer(a) => (shape(a.shape())?, a.iter().map(|&x| x as f64).collect()),
        Raw::Byte(a) => (shape(a.shape())?, a.iter().map(|&x| f64::from(x)).collect()),
        Raw::Flag(yes) => (vec![], vec![f64::from(u8::from(yes))]),
        Raw::Words(_) => return Err(format!("{name} holds words, no numbers")),
    })
}

/// Read a dataset of a file of results as numbers: 0, or 1 and in `message` why not, to be given back by [`signorini_free_text`].
///
/// # Safety
/// `file` and `name` are texts of C, `array` and `message` lead to places for what is written; `message` may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_read(
    file: *const c_char,
    name: *const c_char,
    array: *mut Array,
    message: *mut *mut c_char,
) -> c_int {
    // SAFETY: as said
    let (file, name) = unsafe { (read(file), read(name)) };
    let found = match (file, name) {
        (Some(file), Some(name)) => catch_unwind(|| numbers(Path::new(file), name))
            .unwrap_or_else(|_| Err("reading ended abnormally; please report it".into())),
        _ => Err("the name of the file or of the dataset is null, or no UTF-8".to_owned()),
    };
    let (empty, why) = match found {
        Ok((dimensions, values)) => {
            let mut shape = [1; RANK];
            shape[..dimensions.len()].copy_from_slice(&dimensions);
            let (rank, size) = (dimensions.len(), values.len());
            let data = Box::into_raw(values.into_boxed_slice()).cast();
            // SAFETY: as said
            unsafe { array.write(Array { rank, shape, size, data }) };
            return 0;
        }
        Err(why) => (Array { rank: 0, shape: [0; RANK], size: 0, data: null_mut() }, why),
    };
    // SAFETY: as said
    unsafe {
        array.write(empty);
        if !message.is_null() {
            message.write(text(why).into_raw());
        }
    }
    1
}

/// Give the numbers of an array back.
///
/// # Safety
/// `array` is one that [`signorini_read`] filled, and its numbers are not used any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_free_array(array: *mut Array) {
    if array.is_null() {
        return;
    }
    // SAFETY: as said; an array that was given back is empty
    unsafe {
        let Array { size, data, .. } = array.read();
        if !data.is_null() {
            drop(Box::from_raw(std::ptr::slice_from_raw_parts_mut(data, size)));
        }
        array.write(Array { rank: 0, shape: [0; RANK], size: 0, data: null_mut() });
    }
}

/// Give a message back.
///
/// # Safety
/// `message` is one of [`signorini_read`], or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn signorini_free_text(message: *mut c_char) {
    if !message.is_null() {
        // SAFETY: as said
        drop(unsafe { CString::from_raw(message) });
    }
}
