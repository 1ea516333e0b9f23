//! Messages on their way, as MPI has them.

use super::network::Tag;
use ::mpi::ffi::MPI_Request;

/// What is sent.
pub(super) enum Content {
    Bytes(Vec<u8>),
    Words(Vec<u32>),
}

impl Content {
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Words(words) => bytemuck::cast_slice(words),
        }
    }
}

/// A transfer to another rank, and the memory that MPI reads until it ends.
pub(super) struct Sent {
    pub request: MPI_Request,
    pub content: Content,
}

/// A transfer from another rank, and the memory that MPI writes to until it ends.
pub(super) struct Received {
    pub request: MPI_Request,
    pub from: u32,
    pub mark: MessageKind,
    pub bytes: Vec<u8>,
    pub done: bool,
}

/// What MPI's tag of a message says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MessageKind {
    /// A message.
    Plain(Tag),
    /// Where in the mailbox of its sender one lies.
    Placed(Tag),
    /// That one of this rank's was taken out of its mailbox.
    Taken,
}

/// Added to the tag of what lies in a mailbox.
const PLACED: i32 = 0x40;

impl MessageKind {
    pub fn number(self) -> i32 {
        match self {
            Self::Plain(tag) => tag as i32,
            Self::Placed(tag) => tag as i32 + PLACED,
            Self::Taken => PLACED,
        }
    }

    pub fn of(number: i32) -> Option<Self> {
        match number {
            PLACED => Some(Self::Taken),
            above if above > PLACED => Tag::of(above - PLACED).map(Self::Placed),
            _ => Tag::of(number).map(Self::Plain),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_as_numbers() {
        for number in 0..200 {
            let Some(mark) = MessageKind::of(number) else { continue };
            assert_eq!(mark.number(), number);
        }
        assert_eq!(
            MessageKind::of(MessageKind::Placed(Tag::ImagePart).number()),
            Some(MessageKind::Placed(Tag::ImagePart))
        );
        assert_eq!(MessageKind::of(0), None);
    }
}
