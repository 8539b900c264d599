//! The part of JSON Schema in which `docs/calibration.schema.json` is written. Any other keyword panics.

use serde_json::Value;

/// Each place where a value does not meet a schema, with the keyword that it breaks.
pub(crate) fn violations(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(schema, value, "", &mut found);
    found
}

fn check(schema: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    let length = value.as_array().map(Vec::len);
    for (keyword, rule) in schema.as_object().expect("a schema is an object") {
        let met = match &**keyword {
            "$schema" | "title" | "description" => true,
            "type" => match rule.as_array() {
                Some(kinds) => kinds.iter().any(|kind| is(value, kind)),
                None => is(value, rule),
            },
            "enum" => list(rule).contains(value),
            "anyOf" => list(rule)
                .iter()
                .any(|choice| violations(choice, value).is_empty()),
            "minItems" => length.is_none_or(|it| Some(it as u64) >= rule.as_u64()),
            "maxItems" => length.is_none_or(|it| Some(it as u64) <= rule.as_u64()),
            "items" => {
                for (index, item) in value.as_array().into_iter().flatten().enumerate() {
                    check(rule, item, &format!("{place}/{index}"), found);
                }
                true
            }
            "required" => list(rule).iter().all(|key| {
                let key = key.as_str().expect("a key");
                !value.is_object() || value.get(key).is_some()
            }),
            "properties" => {
                for (key, rule) in rule.as_object().expect("properties") {
                    if let Some(value) = value.get(key) {
                        check(rule, value, &format!("{place}/{key}"), found);
                    }
                }
                true
            }
            "additionalProperties" => {
                assert_eq!(rule, false, "only false is known");
                let mut keys = value.as_object().into_iter().flat_map(|it| it.keys());
                keys.all(|key| schema["properties"].get(key).is_some())
            }
            _ => panic!("{keyword}: not a keyword that the schema uses"),
        };
        if !met {
            found.push(format!("{place}: {keyword} {rule}"));
        }
    }
}

fn is(value: &Value, kind: &Value) -> bool {
    match kind.as_str().expect("the name of a type") {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        kind => panic!("{kind}: not a type of JSON"),
    }
}

fn list(rule: &Value) -> &[Value] {
    rule.as_array().expect("a list")
}
