//! Dates and times of day, as instruments write them, and seconds since 1970.

const DAY: u64 = 86_400;

/// The UTC date of a time in seconds since 1970-01-01.
pub(crate) fn day(seconds: u64) -> String {
    // Days since 0000-03-01: a year ends with its leap day.
    let days = seconds / DAY + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 {
        (era * 400 + year, month + 3)
    } else {
        (era * 400 + year + 1, month - 9)
    };
    format!("{year:04}-{month:02}-{day:02}")
}

/// Days from 1970-01-01 to a date of the Gregorian calendar.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let year = if month > 2 { year } else { year - 1 };
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let leap = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    365 * year + leap + of_year - 719_468
}

/// Seconds of a time of day, `10:00:00.25`, or since 1970 of a date with a time, `2026-03-02T10:00:00`, in UTC or with an
/// offset from it, `+01:00`.
pub(crate) fn seconds(text: &str) -> Option<f64> {
    let Some((date, time)) = text.split_once(['T', 't', ' ']) else {
        return time_of_day(text).or_else(|| date_of(text));
    };
    let (time, offset) = match time.strip_suffix(['Z', 'z']) {
        Some(time) => (time, 0.0),
        None => match time.rfind(['+', '-']).map(|at| time.split_at(at)) {
            Some((time, offset)) => {
                let (sign, offset) = offset.split_at(1);
                let own =
                    time_of_day(offset).or_else(|| Some(3600.0 * number(offset, 23)? as f64))?;
                (time, if sign == "-" { -own } else { own })
            }
            None => (time, 0.0),
        },
    };
    Some(date_of(date)? + time_of_day(time)? - offset)
}

fn date_of(text: &str) -> Option<f64> {
    let mut parts = text.splitn(3, '-');
    let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
    let year = number(year, 9999).filter(|_| year.len() == 4)?;
    let (month, day) = (number(month, 12)?, number(day, 31)?);
    let after = if month == 12 {
        (year + 1, 1)
    } else {
        (year, month + 1)
    };
    let length = days(after.0, after.1, 1) - days(year, month, 1);
    ((1..=12).contains(&month) && (1..=length).contains(&day))
        .then(|| (days(year, month, day) * DAY.cast_signed()) as f64)
}

/// Hours and minutes, and seconds with decimals if any.
fn time_of_day(text: &str) -> Option<f64> {
    let (hours, rest) = text.split_once(':')?;
    let (minutes, seconds) = rest.split_once(':').unwrap_or((rest, "0"));
    let seconds = seconds.replace(',', ".");
    let digits = seconds
        .chars()
        .all(|own| own.is_ascii_digit() || own == '.');
    let seconds: f64 = seconds.parse().ok()?;
    let seconds = Some(seconds).filter(|own| digits && *own < 61.0)?;
    Some((3600 * number(hours, 23)? + 60 * number(minutes, 59)?) as f64 + seconds)
}

fn number(text: &str, most: i64) -> Option<i64> {
    let digits = text.chars().all(|own| own.is_ascii_digit());
    text.parse().ok().filter(|own| digits && *own <= most)
}

#[cfg(test)]
mod tests {
    use super::{day, seconds};

    /// As GNU date has them: `date -u -d … +%s`.
    const KNOWN: [(&str, u64); 7] = [
        ("1970-01-01", 0),
        ("1999-12-31", 946_598_400),
        ("2000-02-29", 951_782_400),
        ("2000-03-01", 951_868_800),
        ("2024-02-29", 1_709_164_800),
        ("2026-02-25", 1_771_977_600),
        ("2100-03-01", 4_107_542_400),
    ];

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (date, since) in KNOWN {
            assert_eq!(day(since), date);
            assert_eq!(day(since + 86_399), date);
            assert_eq!(seconds(date), Some(since as f64), "{date}");
        }
    }

    #[test]
    fn times_are_read_as_instruments_write_them() {
        for (text, expected) in [
            ("10:00:00.25", Some(36_000.25)),
            ("10:00", Some(36_000.0)),
            ("10:00:00,5", Some(36_000.5)),
            ("2000-02-29T00:00:01Z", Some(951_782_401.0)),
            ("2000-02-29 00:00:01", Some(951_782_401.0)),
            ("2000-02-29T01:00:01+01:00", Some(951_782_401.0)),
            ("2000-02-28T22:00:01-02", Some(951_782_401.0)),
            ("2100-02-29", None),
            ("2026-13-01", None),
            ("2026-04-31T10:00:00", None),
            ("25:00:00", None),
            ("10:60:00", None),
            ("P01", None),
            ("", None),
        ] {
            assert_eq!(seconds(text), expected, "{text}");
        }
    }
}
