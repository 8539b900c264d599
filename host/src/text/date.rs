//! Days as people write them.

const DAY: u64 = 86_400;
/// Of 400 years, after which the calendar repeats itself.
const DAYS_OF_ERA: u64 = 146_097;

/// `2026-03-14`, of seconds since the beginning of 1970, in UTC (Howard Hinnant, "chrono-compatible low-level date
/// algorithms").
pub fn of_seconds(seconds: u64) -> String {
    // From 1 March of the year 0, so that the leap day is the last of its year.
    let days = seconds / DAY + 719_468;
    let (era, day) = (days / DAYS_OF_ERA, days % DAYS_OF_ERA);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 {
        (month + 3, 0)
    } else {
        (month - 9, 1)
    };
    let year = year + era * 400 + next;
    format!("{year:04}-{month:02}-{of_month:02}")
}

#[cfg(test)]
mod tests {
    use super::of_seconds;

    /// As `date --utc --date=@SECONDS +%F` prints them.
    #[test]
    fn days_are_those_of_the_calendar() {
        for (seconds, day) in [
            (0, "1970-01-01"),
            (951_782_399, "2000-02-28"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_709_251_199, "2024-02-29"),
            (1_767_225_599, "2025-12-31"),
            (1_767_225_600, "2026-01-01"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(of_seconds(seconds), day);
        }
    }
}
