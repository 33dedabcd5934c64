//! Ranks that are threads of one process. Ranks that are processes communicate by MPI (crate `fem-mpi`).

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::communicator::{Communicator, RankLost};

/// Messages that are sent but not yet received, by (sender, receiver), oldest first.
type Mail = HashMap<(usize, usize), VecDeque<Vec<u8>>>;

/// The messages between the ranks of a process, and for each rank a flag that is true once the rank has ended.
#[derive(Debug, Default)]
struct Post {
    mail: Mutex<(Mail, Vec<bool>)>,
    changed: Condvar,
}

/// A rank that is a thread of this process. When the value is dropped, the other ranks are notified.
#[derive(Debug)]
pub(super) struct ThreadRank {
    rank: usize,
    size: usize,
    post: Arc<Post>,
}

/// Creates `count` ranks that can communicate.
pub(super) fn threads(count: usize) -> Vec<ThreadRank> {
    let mail = Mutex::new((Mail::new(), vec![false; count]));
    let post = Arc::new(Post { mail, changed: Condvar::new() });
    let rank = |rank| ThreadRank { rank, size: count, post: Arc::clone(&post) };
    (0..count).map(rank).collect()
}

impl Post {
    /// Locks the messages and the flags.
    fn lock(&self) -> MutexGuard<'_, (Mail, Vec<bool>)> {
        self.mail.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ThreadRank {
    fn send(&self, to: usize, message: Vec<u8>) {
        self.post.lock().0.entry((self.rank, to)).or_default().push_back(message);
        self.post.changed.notify_all();
    }

    fn receive(&self, from: usize) -> Result<Vec<u8>, RankLost> {
        let mut post = self.post.lock();
        loop {
            if let Some(message) = post.0.get_mut(&(from, self.rank)).and_then(VecDeque::pop_front)
            {
                return Ok(message);
            }
            if post.1[from] {
                return Err(RankLost(from));
            }
            post = self.post.changed.wait(post).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Communicator for ThreadRank {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn exchange(&self, messages: Vec<(usize, Vec<u8>)>) -> Result<Vec<Vec<u8>>, RankLost> {
        let ranks: Vec<usize> = messages.iter().map(|(rank, _)| *rank).collect();
        messages.into_iter().for_each(|(rank, message)| self.send(rank, message));
        ranks.into_iter().map(|rank| self.receive(rank)).collect()
    }

    fn gather(&self, message: &[u8]) -> Result<Vec<Vec<u8>>, RankLost> {
        let others = (0..self.size).filter(|&rank| rank != self.rank);
        others.for_each(|rank| self.send(rank, message.to_vec()));
        let message_of =
            |rank| if rank == self.rank { Ok(message.to_vec()) } else { self.receive(rank) };
        (0..self.size).map(message_of).collect()
    }
}

impl Drop for ThreadRank {
    fn drop(&mut self) {
        self.post.lock().1[self.rank] = true;
        self.post.changed.notify_all();
    }
}
