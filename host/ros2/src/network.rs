//! The ROS 2 domain and the network interface of a node, and the node that has joined them.

use std::net::{IpAddr, Ipv4Addr, UdpSocket};

use plumb_frame::source::BoxedError;
use ros2_client::{
    Context, Name, Node, NodeName, NodeOptions, Publisher, QosProfile, Subscription,
};
use rustdds::{DomainParticipant, DomainParticipantBuilder};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{MAX_DOMAIN, Ros2Error};
use crate::gate::{Gate, Guard};
use crate::interruption;
use crate::message::TypedMessage;
use crate::namespace::Namespace;

/// Variable of ROS 2 with which other programs and this node may not find each other.
struct Requirement {
    name: &'static str,
    /// Whether they find each other with this value.
    is_met: fn(&str) -> bool,
    /// Why they do not, and what is possible.
    why: &'static str,
}

/// Middlewares that speak DDS.
const DDS: [&str; 8] = [
    "rmw_connext_cpp",
    "rmw_connextdds",
    "rmw_connextddsmicro",
    "rmw_cyclonedds_cpp",
    "rmw_fastrtps_cpp",
    "rmw_fastrtps_dynamic_cpp",
    "rmw_gurumdds_cpp",
    "rmw_opensplice_cpp",
];

/// Variables of the middleware.
const MIDDLEWARE: [Requirement; 3] = [
    Requirement {
        name: "RMW_IMPLEMENTATION",
        is_met: |name| DDS.contains(&name),
        why: "but this node speaks DDS only: rmw_fastrtps_cpp, rmw_cyclonedds_cpp or another \
              middleware of DDS, here and in the other programs",
    },
    Requirement {
        name: "ROS_DISCOVERY_SERVER",
        is_met: str::is_empty,
        why: "but other programs are found by multicast only: unset it here and in the other \
              programs",
    },
    Requirement {
        name: "ROS_SECURITY_ENABLE",
        is_met: |value| value != "true",
        why: "but this node has no keys: programs with security do not find it",
    },
];

/// Variables of the networks that other programs use.
const NETWORKS: [Requirement; 2] = [
    Requirement {
        name: "ROS_AUTOMATIC_DISCOVERY_RANGE",
        is_met: |range| ["SUBNET", "SYSTEM_DEFAULT", "LOCALHOST"].contains(&range),
        why: "with which no other program is found: it must be LOCALHOST, SUBNET or \
              SYSTEM_DEFAULT, or not set",
    },
    Requirement {
        name: "ROS_STATIC_PEERS",
        is_met: str::is_empty,
        why: "but other programs are found by multicast only: unset it, and join a network that \
              has multicast",
    },
];

/// Variables with settings for other programs that this node does not read: they may keep the
/// programs from each other.
const UNREAD: [&str; 7] = [
    "CYCLONEDDS_URI",
    "FASTDDS_BUILTIN_TRANSPORTS",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "NDDS_DISCOVERY_PEERS",
    "NDDS_QOS_PROFILES",
    "RMW_CONNEXT_INITIAL_PEERS",
];

/// Checks that the variables, as `variable` returns them, are as they must be.
fn check(
    requirements: &[Requirement],
    variable: impl Fn(&str) -> Option<String>,
) -> Result<(), Ros2Error> {
    let unmet = requirements.iter().find_map(|Requirement { name, is_met, why }| {
        let value = variable(name).filter(|value| !value.is_empty() && !is_met(value))?;
        Some(Ros2Error::Variable { name, value, why })
    });
    unmet.map_or(Ok(()), Err)
}

/// Domain and network interface of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Network {
    /// ROS 2 domain, 0 to [`MAX_DOMAIN`]. Nodes of different domains do not see each other.
    pub domain: u16,
    /// Address of the only interface to use; `None` for all of them. With 127.0.0.1 nothing leaves
    /// this computer.
    pub interface: Option<IpAddr>,
}

impl Network {
    /// Reads the variables of ROS 2, as `variable` returns them: `ROS_DOMAIN_ID`, those of the
    /// middleware, and `ROS_LOCALHOST_ONLY`, without which `ROS_AUTOMATIC_DISCOVERY_RANGE` and
    /// `ROS_STATIC_PEERS` count. What is not set has its default.
    ///
    /// # Errors
    /// [`Ros2Error::DomainVariable`] where `ROS_DOMAIN_ID` is no domain, [`Ros2Error::Variable`]
    /// where other programs do not find this node: it speaks DDS without keys, and finds others by
    /// multicast only.
    pub fn from_variables(variable: impl Fn(&str) -> Option<String>) -> Result<Self, Ros2Error> {
        let domain = match variable("ROS_DOMAIN_ID").filter(|text| !text.is_empty()) {
            Some(text) => match text.parse() {
                Ok(domain) if domain <= MAX_DOMAIN => domain,
                _ => return Err(Ros2Error::DomainVariable(text)),
            },
            None => 0,
        };
        check(&MIDDLEWARE, &variable)?;
        let is_local = variable("ROS_LOCALHOST_ONLY").as_deref() == Some("1") || {
            check(&NETWORKS, &variable)?;
            variable("ROS_AUTOMATIC_DISCOVERY_RANGE").as_deref() == Some("LOCALHOST")
        };
        Ok(Self { domain, interface: is_local.then_some(IpAddr::V4(Ipv4Addr::LOCALHOST)) })
    }

    /// Returns this domain and interface; what is not chosen is that of ROS 2's variables.
    ///
    /// # Errors
    /// As [`from_variables`](Self::from_variables), where no domain is chosen.
    pub fn choose(domain: Option<u16>, interface: Option<IpAddr>) -> Result<Self, Ros2Error> {
        let variable = |name: &str| {
            std::env::var(name).ok().filter(|_| {
                // A domain that is chosen replaces the variable, also a wrong one.
                domain.is_none() || name != "ROS_DOMAIN_ID"
            })
        };
        let usual = Self::from_variables(variable)?;
        let (domain, interface) = (domain.unwrap_or(usual.domain), interface.or(usual.interface));
        Ok(Self { domain, interface })
    }

    /// Returns the variables of the environment with settings of other programs that this node does
    /// not read. With them the programs may not find each other.
    pub fn unread_variables() -> Vec<&'static str> {
        let is_set = |name: &&str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        UNREAD.into_iter().filter(is_set).collect()
    }

    /// Joins the domain with a node that reads messages of up to `max_message` bytes.
    ///
    /// # Errors
    /// Where the domain or the interface does not exist, or no socket can be opened.
    pub(crate) fn join(
        &self,
        namespace: &Namespace,
        name: &str,
        max_message: u32,
    ) -> Result<Member, Ros2Error> {
        if self.domain > MAX_DOMAIN {
            return Err(Ros2Error::Domain(self.domain));
        }
        let interruptions = interruption::count();
        let mut builder = DomainParticipantBuilder::new(self.domain);
        if let Some(address) = self.interface {
            UdpSocket::bind((address, 0))
                .map_err(|source| Ros2Error::Interface { address, source })?;
            builder = builder.with_only_networks([address]);
        }
        let domain = self.domain;
        let build = || builder.build().map_err(BoxedError::from);
        let (participant, gate) =
            Gate::around(domain, self.interface, Guard::new(max_message), build)
                .map_err(|source| Ros2Error::Join { domain, source })?;
        let context = Context::from_domain_participant(participant.clone())
            .map_err(|source| Ros2Error::Join { domain, source: source.into() })?;
        let node = NodeName::new(namespace.as_str(), name)
            .map_err(|_| Ros2Error::Namespace(namespace.as_str().to_owned()))?;
        // Without a spinner, nothing would answer the services of parameters.
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context
            .new_node(node, options)
            .map_err(|source| Ros2Error::Join { domain, source: source.into() })?;
        Ok(Member { node, participant, interruptions, _gate: gate })
    }
}

/// Node that has joined a domain.
pub(crate) struct Member {
    pub(crate) node: Node,
    pub(crate) participant: DomainParticipant,
    /// Number of interruptions of the program before it joined.
    pub(crate) interruptions: u64,
    _gate: Gate,
}

impl Member {
    /// Returns whether the DDS library still runs, as far as is known: an
    /// [`interruption`](crate::interruption) ends its threads.
    pub(crate) fn is_alive(&self) -> bool {
        // The second question goes to one of the threads, and fails once that has ended.
        !self.was_interrupted() && self.participant.assert_liveliness().is_ok()
    }

    /// Returns whether the program was interrupted since the node has joined.
    pub(crate) fn was_interrupted(&self) -> bool {
        interruption::count() != self.interruptions
    }

    /// Creates a publisher on the topic `name`, with its namespace.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where it cannot be created.
    pub(crate) fn publisher<M: TypedMessage + Serialize>(
        &mut self,
        name: &str,
        qos: &QosProfile,
    ) -> Result<Publisher<M>, Ros2Error> {
        let topic = self.topic::<M>(name, qos)?;
        self.node.create_publisher(&topic, None).map_err(Ros2Error::of_endpoint(name))
    }

    /// Creates a subscription to the topic `name`, with its namespace.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where it cannot be created.
    pub(crate) fn subscription<M: TypedMessage + DeserializeOwned + 'static>(
        &mut self,
        name: &str,
        qos: &QosProfile,
    ) -> Result<Subscription<M>, Ros2Error> {
        let topic = self.topic::<M>(name, qos)?;
        self.node.create_subscription(&topic, None).map_err(Ros2Error::of_endpoint(name))
    }

    fn topic<M: TypedMessage>(
        &self,
        name: &str,
        qos: &QosProfile,
    ) -> Result<rustdds::Topic, Ros2Error> {
        let parsed = Name::parse(name).map_err(Ros2Error::of_endpoint(name))?;
        let topic = self.node.create_topic(&parsed, M::type_name(), qos);
        topic.map_err(Ros2Error::of_endpoint(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(variables: &[(&str, &str)]) -> Result<Network, Ros2Error> {
        let find = |name: &str| {
            let found = variables.iter().find(|(it, _)| *it == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        Network::from_variables(find)
    }

    #[test]
    fn the_variables_of_ros_choose_domain_and_interface() {
        assert_eq!(network(&[]).unwrap(), Network::default());
        assert_eq!(network(&[("ROS_DOMAIN_ID", "42")]).unwrap().domain, 42);
        let local = Some(IpAddr::V4(Ipv4Addr::LOCALHOST));
        for (name, value) in
            [("ROS_LOCALHOST_ONLY", "1"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")]
        {
            assert_eq!(network(&[(name, value)]).unwrap().interface, local);
        }
        assert_eq!(network(&[("ROS_LOCALHOST_ONLY", "0")]).unwrap().interface, None);
        for range in ["", "SUBNET", "SYSTEM_DEFAULT"] {
            let network = network(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", range)]).unwrap();
            assert_eq!(network.interface, None);
        }
        // It replaces the others, as in ROS 2.
        let both = [("ROS_LOCALHOST_ONLY", "1"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")];
        assert_eq!(network(&both).unwrap().interface, local);
    }

    #[test]
    fn variables_with_which_no_program_is_found_are_refused() {
        for (name, value) in [
            ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"),
            ("RMW_IMPLEMENTATION", "rmw_email_cpp"),
            ("ROS_DISCOVERY_SERVER", "192.0.2.1:11811"),
            ("ROS_SECURITY_ENABLE", "true"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost"),
            ("ROS_STATIC_PEERS", "192.0.2.1;left.example"),
        ] {
            let error = network(&[(name, value)]).unwrap_err().to_string();
            assert!(error.contains(&format!("{name} is `{value}`")), "{error}");
        }
        for (name, value) in [
            ("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp"),
            ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"),
            ("RMW_IMPLEMENTATION", ""),
            ("ROS_DISCOVERY_SERVER", ""),
            ("ROS_SECURITY_ENABLE", "false"),
        ] {
            assert_eq!(network(&[(name, value)]).unwrap(), Network::default());
        }
    }

    #[test]
    fn a_domain_out_of_range_is_refused() {
        for text in ["233", "-1", "kitchen"] {
            let error = network(&[("ROS_DOMAIN_ID", text)]).unwrap_err().to_string();
            assert!(error.contains(text) && error.contains("0 to 232"), "{error}");
        }
        let network = Network { domain: 233, interface: None };
        let error = network.join(&Namespace::default(), "node", 0).err().map(|e| e.to_string());
        assert!(error.is_some_and(|error| error.contains("233")));
    }

    #[test]
    fn an_interface_of_another_computer_is_refused() {
        let interface = Some("192.0.2.1".parse().unwrap());
        let network = Network { domain: 0, interface };
        let error = network.join(&Namespace::default(), "node", 0).err().map(|e| e.to_string());
        assert!(error.is_some_and(|error| error.contains("192.0.2.1")));
    }
}
