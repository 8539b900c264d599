//! A [`Validation`](crate::validation::Validation) for people and for programs.

pub mod html;
pub mod json;
pub mod table;
mod words;
