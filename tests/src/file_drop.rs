//! Files that are dropped on a window, by the protocol XDND (version 5, freedesktop.org).

use crate::desktop::{Desktop, Failure};
use std::path::Path;
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode, SELECTION_NOTIFY_EVENT,
    SelectionNotifyEvent, Window, WindowClass,
};
use x11rb::wrapper::ConnectionExt as _;

/// Version of the protocol.
const VERSION: u32 = 5;

/// Time limit of a drop.
const LIMIT: Duration = Duration::from_secs(20);

impl Desktop {
    fn atom(&self, name: &str) -> Result<Atom, Failure> {
        Ok(self.connection().intern_atom(false, name.as_bytes())?.reply()?.atom)
    }

    fn tell(&self, to: Window, name: &str, data: [u32; 5]) -> Result<(), Failure> {
        let event = ClientMessageEvent::new(32, to, self.atom(name)?, data);
        self.connection().send_event(false, to, EventMask::NO_EVENT, event)?.check()?;
        Ok(())
    }

    /// Drops a file on a window, at a point of the screen, as a file manager does.
    ///
    /// # Errors
    ///
    /// If the window does not take it within 20 s.
    pub fn drop_file(&self, onto: Window, file: &Path, at: (u32, u32)) -> Result<(), Failure> {
        let connection = self.connection();
        let source = connection.generate_id()?;
        let aux = CreateWindowAux::new();
        connection
            .create_window(0, source, self.root(), 0, 0, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &aux)?
            .check()?;
        let (selection, list) = (self.atom("XdndSelection")?, self.atom("text/uri-list")?);
        connection.set_selection_owner(source, selection, x11rb::CURRENT_TIME)?.check()?;
        self.tell(onto, "XdndEnter", [source, VERSION << 24, list, 0, 0])?;
        let (copy, status, finished) =
            (self.atom("XdndActionCopy")?, self.atom("XdndStatus")?, self.atom("XdndFinished")?);
        self.tell(onto, "XdndPosition", [source, 0, at.0 << 16 | at.1, x11rb::CURRENT_TIME, copy])?;
        let start = Instant::now();
        let mut dropped = false;
        while start.elapsed() < LIMIT {
            match connection.poll_for_event()? {
                Some(Event::SelectionRequest(request)) => {
                    let text = format!("file://{}\r\n", file.display());
                    let property = request.property;
                    connection
                        .change_property8(
                            PropMode::REPLACE,
                            request.requestor,
                            property,
                            list,
                            text.as_bytes(),
                        )?
                        .check()?;
                    let answer = SelectionNotifyEvent {
                        response_type: SELECTION_NOTIFY_EVENT,
                        sequence: 0,
                        time: request.time,
                        requestor: request.requestor,
                        selection,
                        target: request.target,
                        property,
                    };
                    connection.send_event(false, request.requestor, EventMask::NO_EVENT, answer)?.check()?;
                }
                Some(Event::ClientMessage(message)) if message.type_ == status && !dropped => {
                    dropped = true;
                    self.tell(onto, "XdndDrop", [source, 0, x11rb::CURRENT_TIME, 0, 0])?;
                }
                Some(Event::ClientMessage(message)) if message.type_ == finished => {
                    connection.destroy_window(source)?.check()?;
                    return Ok(());
                }
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(10)),
            }
        }
        Err("the window does not take the file".into())
    }
}
