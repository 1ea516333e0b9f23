//! Simulated hosts on one machine, for tests of clusters.
#![allow(clippy::expect_used, reason = "this is how a test fails")]

use crate::program::Temporary;
use std::process::Command;

/// Two network namespaces, which mpirun enters where it would use ssh.
pub struct Hosts {
    /// Names of both namespaces.
    pub names: [String; 2],
    /// Script that mpirun calls in place of ssh.
    pub agent: String,
}

impl Hosts {
    /// Creates the namespaces. Without the rights to, returns `None` and prints the reason.
    ///
    /// # Panics
    ///
    /// If the agent cannot be written.
    pub fn make(folder: &Temporary) -> Option<Self> {
        let id = std::process::id() % 10_000;
        let names = [1, 2].map(|host| format!("tri{id}h{host}"));
        let mut lines = String::from("set -e\n");
        for (index, name) in names.iter().enumerate() {
            let (net, outer) = (index + 1, format!("tv{id}o{index}"));
            lines += &format!(
                "ip netns add {name}\nip link add {outer} type veth peer name eth0 netns {name}\n\
                 ip addr add 10.{a}.{net}.1/24 dev {outer}\nip link set {outer} up\n\
                 ip -n {name} addr add 10.{a}.{net}.2/24 dev eth0\nip -n {name} link set eth0 up\nip -n {name} link set lo up\n\
                 ip -n {name} route add default via 10.{a}.{net}.1\n",
                a = 64 + id % 64
            );
        }
        lines += "echo 1 > /proc/sys/net/ipv4/ip_forward\n";
        let agent = folder.file("agent.sh");
        // The agent takes ssh's arguments: a host's name, then a command for its shell.
        let script = "#!/bin/sh\nhost=$1; shift\nexec ip netns exec \"$host\" unshare --uts sh -c \"hostname $host; $*\"\n";
        std::fs::write(&agent, script).expect("the agent");
        let hosts = Self { names, agent };
        let made = Command::new("sh").args(["-c", &format!("chmod +x {} && {lines}", hosts.agent)]).output();
        match made {
            Ok(made) if made.status.success() => Some(hosts),
            other => {
                eprintln!("SKIPPED: no network namespaces: {other:?}");
                None
            }
        }
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for name in &self.names {
            let _ = Command::new("ip").args(["netns", "del", name]).output();
        }
    }
}
