//! What the API can do, for programs (OpenAPI 3.1) and for people: both are made from the table.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Map, Value, json};

use vimc4_answers::entry;
use vimc4_answers::fields::{Field, Of, image};
use vimc4_answers::problem::KINDS;
use vimc4_answers::table::{ROUTES, Route};

/// The schemas of what is answered.
const SCHEMAS: &str = include_str!("schemas.json");

/// The document.
pub(crate) fn openapi() -> Value {
    let mut paths: BTreeMap<&str, Map<String, Value>> = BTreeMap::new();
    for route in ROUTES {
        let methods = paths.entry(route.path).or_default();
        methods.insert(route.method.to_lowercase(), operation(route));
    }
    // A file of this program, which a test reads.
    let schemas: Value = serde_json::from_str(SCHEMAS).unwrap_or_default();
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "virtual IMC4",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "See and steer virtual stepper controllers. Times are nanoseconds of \
                            the controller's own time. Events as they happen: the WebSocket \
                            /v1/events.",
            "license": { "name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0" },
        },
        "servers": [{ "url": "/" }],
        "security": [{}, { "token": [] }],
        "paths": paths,
        "components": {
            "schemas": schemas,
            "responses": { "Problem": {
                "description": "What was wrong, and what would be right",
                "content": { "application/problem+json": {
                    "schema": { "$ref": "#/components/schemas/Problem" },
                } },
            } },
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } },
        },
    })
}

fn operation(route: &Route) -> Value {
    let in_path = parameters(route.path).map(|name| {
        let schema = match name {
            "name" => json!({ "type": "string" }),
            _ => json!({ "type": "integer", "minimum": 0 }),
        };
        json!({ "name": name, "in": "path", "required": true, "schema": schema })
    });
    let in_query = route.query.iter().map(|field| {
        json!({
            "name": field.name,
            "in": "query",
            "required": field.is_needed,
            "description": field.about,
            "schema": schema(field),
        })
    });
    let kind = match route.answer {
        "Profile" | "Image" => "text/plain",
        "Recording" => "application/x-ndjson",
        "Held" => "text/plain",
        _ => "application/json",
    };
    let answer = json!({ "$ref": format!("#/components/schemas/{}", route.answer) });
    let mut operation = json!({
        "summary": route.about,
        "operationId": name_of(route),
        "parameters": in_path.chain(in_query).collect::<Vec<_>>(),
        "responses": {
            "200": { "description": "Done", "content": { kind: { "schema": answer } } },
            "default": { "$ref": "#/components/responses/Problem" },
        },
    });
    if !route.body.is_empty() {
        let properties = route.body.iter().map(|field| (field.name.to_owned(), schema(field)));
        let needed = route.body.iter().filter(|field| field.is_needed).map(|field| field.name);
        let needed: Vec<&str> = needed.collect();
        operation["requestBody"] = json!({
            "required": !needed.is_empty(),
            "content": { "application/json": { "schema": {
                "type": "object",
                "properties": properties.collect::<Map<_, _>>(),
                "required": needed,
                "additionalProperties": false,
            } } },
        });
        if image(route.body).is_some() {
            operation["requestBody"]["content"]["application/octet-stream"] = json!({});
        }
    }
    operation
}

/// `post-controllers-n-clock-advance`: what programs that are made from the document call it.
fn name_of(route: &Route) -> String {
    let parts = route.path.split('/').skip(2).map(|part| part.trim_matches(['{', '}']));
    let method = route.method.to_lowercase();
    std::iter::once(&*method).chain(parts).collect::<Vec<_>>().join("-")
}

fn parameters(path: &str) -> impl Iterator<Item = &str> {
    path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'))
}

fn schema(field: &Field) -> Value {
    let kind = match field.of {
        Of::Text | Of::Image => json!("string"),
        Of::Number => json!("integer"),
        Of::Value => json!(["integer", "string"]),
    };
    let mut schema =
        json!({ "type": kind, "description": field.about, "examples": [field.example()] });
    if field.of == Of::Number {
        schema["minimum"] = 0.into();
    }
    schema
}

/// The page.
pub(crate) fn page() -> String {
    let mut rows = String::new();
    for route in ROUTES {
        let object = |fields: &[Field]| {
            let fields = fields.iter().map(|field| (field.name.to_owned(), field.example()));
            Value::Object(fields.collect()).to_string()
        };
        let query = route.query.iter().map(|field| format!("{}={}", field.name, field.example));
        let query: Vec<String> = query.collect();
        let asked = match (route.query, route.body) {
            ([], []) => String::new(),
            ([], body) => object(body),
            _ => format!("?{}", query.join("&")),
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            rows,
            "<tr><td>{}<td><code>{}</code><td><code>{}</code><td>{}",
            route.method,
            plain(route.path),
            plain(&asked),
            plain(route.about)
        );
    }
    let kinds = entry::KINDS.iter();
    let kinds = kinds.map(|(kind, about)| format!("<tr><td><code>{kind}</code><td>{about}\n"));
    let problems = KINDS.iter().map(|(_, name, status, title)| {
        format!("<tr id=\"{name}\"><td>{}<td><code>{name}</code><td>{title}\n", status)
    });
    include_str!("page.html")
        .replace("<!--routes-->", &rows)
        .replace("<!--kinds-->", &kinds.collect::<String>())
        .replace("<!--problems-->", &problems.collect::<String>())
}

fn plain(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_answer_has_a_schema_and_every_schema_an_answer() {
        let schemas: Map<String, Value> = serde_json::from_str(SCHEMAS).unwrap();
        let document = openapi().to_string();
        for name in schemas.keys() {
            assert!(document.contains(&format!("\"#/components/schemas/{name}\"")), "{name}");
        }
        for route in ROUTES {
            assert!(schemas.contains_key(route.answer), "{}", route.answer);
        }
        let mut names: Vec<String> = ROUTES.iter().map(name_of).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), ROUTES.len());
    }
}
