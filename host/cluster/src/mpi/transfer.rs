//! Records of the transfers of `mpi`: their content, requests and tags.

use crate::network::Tag;
use ::mpi::ffi::MPI_Request;

/// Content of a message.
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

/// Transfer to another rank, with the memory that MPI reads until it ends.
pub(super) struct Sent {
    pub request: MPI_Request,
    pub content: Content,
}

/// Transfer from another rank, with the memory that MPI writes until it ends.
pub(super) struct Received {
    pub request: MPI_Request,
    pub from: u32,
    pub mark: MessageKind,
    pub bytes: Vec<u8>,
    pub done: bool,
}

/// Meaning of a message, from its MPI tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MessageKind {
    /// The message itself.
    Plain(Tag),
    /// The slot of a message in its sender's shared memory.
    Placed(Tag),
    /// Confirmation that a message of this rank was taken from its shared memory.
    Taken,
}

/// Offset of the MPI tags of messages in shared memory; it is itself the tag of confirmations.
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
