//! A child process with a time limit, which is stopped with all processes that it has started.

use std::io;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Longest time between two checks of a running process.
const DELAY: Duration = Duration::from_millis(50);

/// Why a process ended.
#[derive(Debug)]
pub(super) enum ProcessEnd {
    Exited(ExitStatus),
    /// The process was stopped at the time limit.
    TimeLimit,
    /// The process was stopped because the user interrupted this program.
    Interrupted,
}

/// Runs a command until it ends. Stops it, and all processes of its group, once `limit` has passed or `interrupt` is
/// true.
///
/// # Errors
/// Fails if the program cannot be started.
pub(super) fn run_process(
    mut command: Command,
    limit: Option<Duration>,
    interrupt: &AtomicBool,
) -> io::Result<ProcessEnd> {
    command.stdin(Stdio::null());
    // start the process in a separate process group, so that all processes of this group can be
    // stopped
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn()?;
    let (start, mut delay) = (Instant::now(), Duration::from_millis(1));
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(ProcessEnd::Exited(status));
        }
        if interrupt.load(Ordering::Relaxed) {
            stop(&mut child);
            return Ok(ProcessEnd::Interrupted);
        }
        if limit.is_some_and(|limit| start.elapsed() > limit) {
            stop(&mut child);
            return Ok(ProcessEnd::TimeLimit);
        }
        std::thread::sleep(delay);
        delay = (2 * delay).min(DELAY);
    }
}

/// Stops a process and the other processes of its group, and waits for its end.
fn stop(child: &mut Child) {
    #[cfg(unix)]
    {
        // the standard library can only stop single processes; the command `kill` of a shell is
        // part of POSIX
        let kill = format!("kill -s KILL -- -{}", child.id());
        let _ = Command::new("sh").args(["-c", &kill]).stderr(Stdio::null()).status();
    }
    // does nothing if the process has ended
    let _ = child.kill();
    let _ = child.wait();
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn a_process_ends_by_itself_with_its_status() {
        let end = run_process(shell("exit 3"), None, &AtomicBool::new(false)).unwrap();
        assert!(matches!(end, ProcessEnd::Exited(status) if status.code() == Some(3)));
        let mut absent = Command::new("/no/such/program");
        absent.arg("x");
        assert!(run_process(absent, None, &AtomicBool::new(false)).is_err());
    }

    #[test]
    fn a_process_and_its_children_are_stopped_at_the_limit_and_by_an_interrupt() {
        let dir = tempfile::tempdir().unwrap();
        for (is_interrupted, name) in [(false, "limit"), (true, "interrupt")] {
            let (started, mark) = (dir.path().join(name), dir.path().join(format!("{name}-end")));
            // the grandchild would write its mark if it were not stopped
            let script =
                format!("(touch {:?}; sleep 2; touch {:?}) & sleep 60; wait", started, mark);
            let limit = (!is_interrupted).then_some(Duration::from_millis(300));
            let interrupt = AtomicBool::new(false);
            let end = std::thread::scope(|scope| {
                let run = scope.spawn(|| run_process(shell(&script), limit, &interrupt).unwrap());
                while !started.exists() {
                    std::thread::sleep(Duration::from_millis(5));
                }
                interrupt.store(is_interrupted, Ordering::Relaxed);
                run.join().unwrap()
            });
            assert_eq!(matches!(end, ProcessEnd::Interrupted), is_interrupted, "{end:?}");
            assert_eq!(matches!(end, ProcessEnd::TimeLimit), !is_interrupted, "{end:?}");
            std::thread::sleep(Duration::from_millis(2500));
            assert!(!mark.exists(), "{name}: the grandchild was not stopped");
        }
    }
}
