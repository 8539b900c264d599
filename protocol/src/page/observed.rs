//! The messages of observations, written from the page alone.

use super::pieces::{Bits, Pieces};
use crate::{BeginObservations, ObservationMessage, Places, PlaneMessage, PointMessage};
use delta_cal::observations::{DistanceFrom, ObservationError};
use std::format;

impl Pieces {
    pub(super) fn begin_observations<T: Bits>(&mut self, begin: &BeginObservations<T>) {
        let BeginObservations {
            session,
            tolerance,
            noise: (position, joint),
            height_noise,
            distance_noise,
            plane_count,
            planes,
            point_count,
            points,
        } = begin;
        self.varint("session", *session);
        self.pair("tolerance", *tolerance);
        self.numbers("position", position);
        self.number("joint", *joint);
        self.number("height_noise", *height_noise);
        self.number("distance_noise", *distance_noise);
        self.add(&[*plane_count], &format!("plane_count = {plane_count}"));
        for PlaneMessage { known, level } in planes {
            self.pair("known", *known);
            self.option("level", level.is_some());
            if let Some(level) = level {
                self.number("level", *level);
            }
        }
        self.add(&[*point_count], &format!("point_count = {point_count}"));
        for PointMessage { known, offset } in points {
            self.option("known", known.is_some());
            if let Some((place, sigma)) = known {
                self.numbers("place", place);
                self.number("sigma", *sigma);
            }
            self.add(&[(*offset).into()], &format!("offset = {offset}"));
        }
    }

    pub(super) fn observation<T: Bits>(&mut self, observation: &ObservationMessage<T>) {
        let ObservationMessage {
            session,
            index,
            joints,
            position,
            height,
            distance,
        } = observation;
        self.varint("session", *session);
        self.varint("index", *index);
        self.numbers("joints", joints);
        for (name, coordinate) in ["x", "y", "z"].into_iter().zip(position) {
            self.option(name, coordinate.is_some());
            if let Some(coordinate) = coordinate {
                self.number(name, *coordinate);
            }
        }
        self.option("height", height.is_some());
        if let Some((plane, height)) = height {
            self.add(&[*plane], &format!("plane = {plane}"));
            self.number("height", *height);
        }
        self.option("distance", distance.is_some());
        if let Some((from, distance)) = distance {
            const OF: &str = "DistanceFrom";
            match from {
                DistanceFrom::Point(point) => {
                    self.variant(OF, 0, "Point");
                    self.add(&[*point], &format!("index = {point}"));
                }
                DistanceFrom::Pose(joints) => {
                    self.variant(OF, 1, "Pose");
                    self.numbers("joints", joints);
                }
            }
            self.number("distance", *distance);
        }
    }

    pub(super) fn places<T: Bits>(&mut self, places: &Places<T>) {
        let Places { planes, points } = places;
        for (index, plane) in planes.iter().enumerate() {
            self.numbers(&format!("plane {index}"), plane);
        }
        for (index, point) in points.iter().enumerate() {
            self.numbers(&format!("point {index}"), point);
        }
    }

    pub(super) fn observation_error(&mut self, error: ObservationError) {
        const OF: &str = "ObservationError";
        match error {
            ObservationError::Joints(error) => {
                self.variant(OF, 0, "Joints");
                self.sample_error(error);
            }
            ObservationError::Nothing => self.variant(OF, 1, "Nothing"),
            ObservationError::NonFinite => self.variant(OF, 2, "NonFinite"),
            ObservationError::DistanceNotPositive => self.variant(OF, 3, "DistanceNotPositive"),
            ObservationError::NoSuchPlane(index) => {
                self.variant(OF, 4, "NoSuchPlane");
                self.add(&[index], &format!("index = {index}"));
            }
            ObservationError::NoSuchPoint(index) => {
                self.variant(OF, 5, "NoSuchPoint");
                self.add(&[index], &format!("index = {index}"));
            }
            ObservationError::SamePlace => self.variant(OF, 6, "SamePlace"),
            other => panic!("{other:?} is not described"),
        }
    }
}
