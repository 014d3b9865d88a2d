//! How much memory a piece of work takes: live bytes of the heap, and their highest number.
//!
//! By hand because counting allocators such as `stats_alloc` share one counter between all threads and have no
//! highest number for a piece of work inside another.
//!
//! Resident sizes depend on what ran before, since an allocator keeps freed pages; live bytes do
//! not. A program that wants them measured installs [`Heap`]; without it all numbers are 0.
//!
//! ```
//! #[global_allocator]
//! static HEAP: medial::heap::Heap = medial::heap::Heap;
//!
//! let (numbers, usage) = medial::heap::usage_of(|| vec![0u8; 1 << 20]);
//! assert!(usage.held_bytes >= 1 << 20 && usage.peak_bytes >= usage.held_bytes);
//! drop(numbers);
//! ```

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicI64, Ordering};

use serde::{Deserialize, Serialize};

/// The system's allocator, counting.
///
/// Each thread counts for itself and hands its count over now and then, so that threads do not
/// contend for one counter: the totals are short of at most 64 KiB for each thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Heap;

/// A thread hands over once it has allocated or freed this many bytes more than the reverse.
const HAND_OVER: i64 = 64 * 1024;

/// Live bytes of all threads, except bytes not yet handed over.
static LIVE: AtomicI64 = AtomicI64::new(0);
/// The highest [`LIVE`] since the last [`usage_of`] began or ended.
static HIGHEST: AtomicI64 = AtomicI64::new(0);
/// The highest number of live bytes that a surrounding [`usage_of`] had seen before an inner one.
static SURROUNDING: AtomicI64 = AtomicI64::new(0);

thread_local! {
    static PENDING: Cell<i64> = const { Cell::new(0) };
}

/// Runs when an allocation fails.
static ON_REFUSAL: OnceLock<fn()> = OnceLock::new();

/// Sets a function that runs whenever an allocation fails, before the program aborts or copes.
/// The first call counts. `hook` must not allocate.
pub fn on_refusal(hook: fn()) {
    let _ = ON_REFUSAL.set(hook);
}

/// A pointer as the system returned it, its bytes counted.
fn counted(pointer: *mut u8, bytes: i64) -> *mut u8 {
    if !pointer.is_null() {
        count(bytes);
    } else if let Some(hook) = ON_REFUSAL.get() {
        hook();
    }
    pointer
}

fn count(bytes: i64) {
    // While a thread ends its cell may be gone: later allocations are not counted.
    let _ = PENDING.try_with(|pending| {
        pending.set(pending.get() + bytes);
        if pending.get().abs() >= HAND_OVER {
            hand_over(pending);
        }
    });
}

fn hand_over(pending: &Cell<i64>) {
    let sum = pending.replace(0);
    let live = LIVE.fetch_add(sum, Ordering::Relaxed) + sum;
    HIGHEST.fetch_max(live, Ordering::Relaxed);
}

// SAFETY: every call goes to the system's allocator as it is; counting allocates nothing, since the
// thread's cell is initialised at compile time and has no destructor.
#[allow(unsafe_code)] // An allocator cannot be written without.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's guarantee is passed on.
        counted(unsafe { System.alloc(layout) }, layout.size() as i64)
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        counted(unsafe { System.alloc_zeroed(layout) }, layout.size() as i64)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) };
        count(-(layout.size() as i64));
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        let moved = unsafe { System.realloc(pointer, layout, size) };
        counted(moved, size as i64 - layout.size() as i64)
    }
}

/// Heap use of a piece of work, beyond the live bytes at its begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Usage {
    /// Live bytes at its end; 0 where it freed more than it allocated.
    pub held_bytes: u64,
    /// The highest number of live bytes during the work.
    pub peak_bytes: u64,
}

/// Runs `work` and measures its heap use, on all threads of the process.
///
/// Calls may be nested. Calls side by side on two threads see each other's bytes.
pub fn usage_of<T>(work: impl FnOnce() -> T) -> (T, Usage) {
    measured(work, |surrounding, highest| surrounding.max(highest))
}

/// As [`usage_of`], for work that is accounted for separately: memory that it frees again is not in the peak of a
/// surrounding call, memory that it leaves is.
pub fn usage_apart<T>(work: impl FnOnce() -> T) -> (T, Usage) {
    measured(work, |surrounding, _| surrounding)
}

/// Measures `work`. `outer` computes the peak of a surrounding call from the highest number of live bytes before and
/// during the work.
fn measured<T>(work: impl FnOnce() -> T, outer: impl FnOnce(i64, i64) -> i64) -> (T, Usage) {
    PENDING.with(hand_over);
    let before = LIVE.load(Ordering::Relaxed);
    // The peak of the surrounding work is saved, and restored at the end.
    let seen = HIGHEST.swap(before, Ordering::Relaxed);
    let surrounding = SURROUNDING.swap(before, Ordering::Relaxed).max(seen);
    let value = work();
    PENDING.with(hand_over);
    let after = LIVE.load(Ordering::Relaxed);
    let inner = SURROUNDING.load(Ordering::Relaxed);
    let highest = HIGHEST.swap(after, Ordering::Relaxed).max(inner);
    SURROUNDING.store(outer(surrounding, highest), Ordering::Relaxed);
    let beyond = |bytes: i64| u64::try_from(bytes - before).unwrap_or(0);
    (value, Usage { held_bytes: beyond(after), peak_bytes: beyond(highest) })
}
