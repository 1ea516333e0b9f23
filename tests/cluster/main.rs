//! One image over several ranks: processes of MPI, and threads of one process.

mod checkpoint;
mod distribute;
mod ranks;
