//! The messages of which the page shows the bytes.

use super::described::Message;
use super::pieces::Bits;
use super::requests::requests;
use super::responses::{faults, responses};
use crate::{Fault, Response, UNKNOWN_SEQUENCE};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::vec::Vec;

/// Of every frame but one.
pub(super) const SEQUENCE: u16 = 0x1234;

#[derive(Debug)]
pub(super) struct Case<T> {
    pub(super) name: &'static str,
    pub(super) message: Message<T>,
}

impl<T> Case<T> {
    pub(super) fn sequence(&self) -> u16 {
        match &self.message {
            Message::Response(Response::Fault(Fault::Damaged)) => UNKNOWN_SEQUENCE,
            _ => SEQUENCE,
        }
    }
}

/// Messages in whole frames.
pub(super) fn cases<T: Bits + Serialize + DeserializeOwned>() -> Vec<Case<T>> {
    let requests = requests().into_iter().map(|(name, request)| Case {
        name,
        message: Message::Request(request),
    });
    let faults = faults()
        .into_iter()
        .map(|(name, fault)| (name, Response::Fault(fault)));
    let responses = faults.chain(responses()).map(|(name, response)| Case {
        name,
        message: Message::Response(response),
    });
    requests.chain(responses).collect()
}
