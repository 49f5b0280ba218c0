//! Expressions over everything that is visible.
//!
//! ```text
//! expression = all { "or" all }             all  = none { "and" none }
//! none       = ["not"] comparison           comparison = sum [ ("<"|"<="|"="|"!="|">="|">") sum ]
//! sum        = product { ("+"|"-") product } product = one { ("*"|"/"|"%") one }
//! one        = NUMBER | "TEXT" | FIELD | "true" | "false" | "on" | "off" | "none"
//!            | "-" one | "(" expression ")"
//! ```
//!
//! A word after a comparison that is not a field is text, so that `activity = idle` works as meant.

use std::cmp::Ordering;
use std::fmt;

use serde_json::Value;
use vimc4_catalogue::Controller;
use vimc4_device::Time;

use crate::{DebugError, Field};

/// How deep brackets may be nested.
const DEEPEST: u32 = 32;

/// How many operators an expression may have: each makes the tree that is gone through a node deeper,
/// in brackets or not.
const OPERATORS_MAX: u32 = 256;

/// Something that has a value at any moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    text: String,
    root: Node,
}

#[derive(Clone, Debug, PartialEq)]
enum Node {
    Constant(Value),
    Field(Field),
    Not(Box<Node>),
    Minus(Box<Node>),
    Pair(Box<Node>, Operator, Box<Node>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Or,
    And,
    Less,
    AtMost,
    Equal,
    Unequal,
    AtLeast,
    More,
    Plus,
    Minus,
    Times,
    By,
    Rest,
}

impl Expression {
    /// Reads an expression about a controller.
    ///
    /// # Errors
    ///
    /// If the text is no expression, or names a field that does not exist.
    pub fn parse(text: &str, device: &Controller) -> Result<Expression, DebugError> {
        let mut reader = Reader { rest: text, device, depth: 0, operators: 0, is_compared: false };
        let root = reader.any()?;
        match reader.rest.trim() {
            "" => Ok(Expression { text: text.trim().to_owned(), root }),
            rest => Err(DebugError::new(format!(
                "`{}` is wrong at `{rest}`: an operator such as `and` or `<`, or nothing more",
                text.trim()
            ))),
        }
    }

    /// Its value at `at`, a time from the device's present until its next cause.
    ///
    /// # Errors
    ///
    /// If its values cannot be calculated with.
    pub fn value(&self, device: &Controller, at: Time) -> Result<Value, DebugError> {
        self.root.value(device, at)
    }

    /// Whether it is true at `at`: not false, 0, none or empty. What cannot be calculated is not
    /// true.
    #[must_use]
    pub fn is_so(&self, device: &Controller, at: Time) -> bool {
        self.value(device, at).is_ok_and(|value| is_true(&value))
    }

    /// Whether it is a comparison or the like, which holds or does not, rather than a mere value.
    #[must_use]
    pub(crate) fn is_claim(&self) -> bool {
        match &self.root {
            Node::Not(_) | Node::Constant(Value::Bool(_)) => true,
            Node::Pair(_, operator, _) => operator.is_claim(),
            _ => false,
        }
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Whether a text can follow a value within an expression.
pub(crate) fn begins_with_operator(text: &str) -> bool {
    let word = text.split_whitespace().next().unwrap_or_default();
    matches!(word, "and" | "or" | "is")
        || word.starts_with(['+', '-', '*', '/', '%', '<', '>', '=', '!', '&', '|'])
}

pub(crate) fn is_true(value: &Value) -> bool {
    match value {
        Value::Null => false,
        Value::Bool(is_so) => *is_so,
        Value::Number(number) => number.as_f64() != Some(0.0),
        Value::String(text) => !text.is_empty(),
        Value::Array(parts) => !parts.is_empty(),
        Value::Object(parts) => !parts.is_empty(),
    }
}

impl Operator {
    fn is_claim(self) -> bool {
        use Operator::*;
        matches!(self, Or | And | Less | AtMost | Equal | Unequal | AtLeast | More)
    }
}

impl Node {
    fn value(&self, device: &Controller, at: Time) -> Result<Value, DebugError> {
        Ok(match self {
            Node::Constant(value) => value.clone(),
            Node::Field(field) => field.value(device, at),
            Node::Not(node) => (!is_true(&node.value(device, at)?)).into(),
            Node::Minus(node) => {
                let value = integer(&node.value(device, at)?)?;
                value.checked_neg().ok_or_else(too_large)?.into()
            }
            Node::Pair(left, operator, right) => {
                let one = left.value(device, at)?;
                match operator {
                    Operator::Or if is_true(&one) => return Ok(true.into()),
                    Operator::And if !is_true(&one) => return Ok(false.into()),
                    _ => {}
                }
                combined(&one, *operator, &right.value(device, at)?)?
            }
        })
    }
}

fn combined(one: &Value, operator: Operator, other: &Value) -> Result<Value, DebugError> {
    use Operator::*;
    let order = || ordering(one, other);
    Ok(match operator {
        Or | And => is_true(other).into(),
        Equal => (same(one, other)).into(),
        Unequal => (!same(one, other)).into(),
        Less => (order()? == Ordering::Less).into(),
        AtMost => (order()? != Ordering::Greater).into(),
        AtLeast => (order()? != Ordering::Less).into(),
        More => (order()? == Ordering::Greater).into(),
        Plus | Minus | Times | By | Rest => {
            let (one, other) = (integer(one)?, integer(other)?);
            let result = match operator {
                Plus => one.checked_add(other),
                Minus => one.checked_sub(other),
                Times => one.checked_mul(other),
                _ if other == 0 => return Err(DebugError::new("division by 0")),
                By => one.checked_div(other),
                _ => one.checked_rem(other),
            };
            result.ok_or_else(too_large)?.into()
        }
    })
}

fn too_large() -> DebugError {
    DebugError::new("the result is too large")
}

/// For switches, 0 and 1 equal off and on.
fn number(value: &Value) -> Option<i64> {
    match value {
        Value::Bool(is_so) => Some((*is_so).into()),
        value => value.as_i64(),
    }
}

fn integer(value: &Value) -> Result<i64, DebugError> {
    number(value).ok_or_else(|| DebugError::new(format!("`{value}` is not a whole number")))
}

fn same(one: &Value, other: &Value) -> bool {
    match (number(one), number(other)) {
        (Some(one), Some(other)) => one == other,
        _ => one == other,
    }
}

fn ordering(one: &Value, other: &Value) -> Result<Ordering, DebugError> {
    if let (Some(one), Some(other)) = (number(one), number(other)) {
        return Ok(one.cmp(&other));
    }
    let numbers = one.as_f64().zip(other.as_f64());
    if let Some(order) = numbers.and_then(|(one, other)| one.partial_cmp(&other)) {
        return Ok(order);
    }
    match (one, other) {
        (Value::String(one), Value::String(other)) => Ok(one.cmp(other)),
        _ => Err(DebugError::new(format!("`{one}` and `{other}` have no order"))),
    }
}

/// Reads from left to right.
struct Reader<'t> {
    rest: &'t str,
    device: &'t Controller,
    depth: u32,
    /// How many operators have been read.
    operators: u32,
    /// After a comparison, where a word may be text.
    is_compared: bool,
}

impl<'t> Reader<'t> {
    fn any(&mut self) -> Result<Node, DebugError> {
        let mut node = self.all()?;
        while self.word("or") || self.symbol("||") {
            node = self.pair(node, Operator::Or, Reader::all)?;
        }
        Ok(node)
    }

    fn all(&mut self) -> Result<Node, DebugError> {
        let mut node = self.none()?;
        while self.word("and") || self.symbol("&&") {
            node = self.pair(node, Operator::And, Reader::none)?;
        }
        Ok(node)
    }

    fn none(&mut self) -> Result<Node, DebugError> {
        let mut turns = 0_u32;
        while self.word("not") || (!self.rest.trim_start().starts_with("!=") && self.symbol("!")) {
            turns += 1;
        }
        let node = self.comparison()?;
        Ok(match turns {
            0 => node,
            turns if turns % 2 == 1 => Node::Not(Box::new(node)),
            _ => Node::Not(Box::new(Node::Not(Box::new(node)))),
        })
    }

    fn comparison(&mut self) -> Result<Node, DebugError> {
        const OPERATORS: [(&str, Operator); 8] = [
            ("<=", Operator::AtMost),
            (">=", Operator::AtLeast),
            ("!=", Operator::Unequal),
            ("==", Operator::Equal),
            ("<", Operator::Less),
            (">", Operator::More),
            ("=", Operator::Equal),
            ("is ", Operator::Equal),
        ];
        let node = self.sum()?;
        match OPERATORS.into_iter().find(|(symbol, _)| self.symbol(symbol)) {
            Some((_, operator)) => {
                self.is_compared = true;
                let compared = self.pair(node, operator, Reader::sum);
                self.is_compared = false;
                compared
            }
            None => Ok(node),
        }
    }

    fn sum(&mut self) -> Result<Node, DebugError> {
        let mut node = self.product()?;
        loop {
            let operator = match () {
                () if self.symbol("+") => Operator::Plus,
                () if self.symbol("-") => Operator::Minus,
                () => return Ok(node),
            };
            node = self.pair(node, operator, Reader::product)?;
        }
    }

    fn product(&mut self) -> Result<Node, DebugError> {
        let mut node = self.one()?;
        loop {
            let operator = match () {
                () if self.symbol("*") => Operator::Times,
                () if self.symbol("/") => Operator::By,
                () if self.symbol("%") => Operator::Rest,
                () => return Ok(node),
            };
            node = self.pair(node, operator, Reader::one)?;
            let is_zero = |node: &Node| match node {
                Node::Pair(_, Operator::By | Operator::Rest, by) => {
                    **by == Node::Constant(0.into())
                }
                _ => false,
            };
            if is_zero(&node) {
                return Err(DebugError::new("division by 0"));
            }
        }
    }

    fn one(&mut self) -> Result<Node, DebugError> {
        let wrong = |rest: &str| {
            let there = match rest {
                "" => "the end".to_owned(),
                rest => format!("`{}`", rest.chars().take(40).collect::<String>()),
            };
            DebugError::new(format!(
                "a number, a \"text\" or a field such as `x`, `x.speed` or `details.program` is \
                 missing at {there}"
            ))
        };
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(DebugError::new("too many brackets or signs within each other"));
        }
        self.rest = self.rest.trim_start();
        let node = if self.symbol("(") {
            let node = self.any()?;
            if !self.symbol(")") {
                return Err(DebugError::new("a `)` is missing"));
            }
            node
        } else if self.symbol("-") {
            Node::Minus(Box::new(self.one()?))
        } else if let Some(quote) = self.rest.strip_prefix('"') {
            let (text, rest) = quote.split_once('"').ok_or_else(|| wrong(self.rest))?;
            match rest.strip_prefix('.') {
                // The name of a field in quotation marks.
                Some(_) => self.field().ok_or_else(|| wrong(self.rest))??,
                None => {
                    self.rest = rest;
                    Node::Constant(text.into())
                }
            }
        } else {
            self.field().ok_or_else(|| wrong(self.rest))??
        };
        self.depth -= 1;
        Ok(node)
    }

    /// A number, a word that means something, a field, or another word.
    fn field(&mut self) -> Option<Result<Node, DebugError>> {
        let text = self.rest;
        let (mut end, mut quotes, mut brackets) = (0, false, 0_u32);
        for (at, c) in text.char_indices() {
            let is_inside = quotes || brackets > 0;
            match c {
                '"' => quotes = !quotes,
                '[' if !quotes => brackets += 1,
                ']' if !quotes => brackets = brackets.saturating_sub(1),
                '-' if at == 0 => break,
                _ if is_inside => {}
                // A hyphen belongs to the word if a letter follows; otherwise it is a minus.
                '-' if text[at + 1..].starts_with(char::is_alphabetic)
                    && !text[..at].starts_with(|c: char| c.is_ascii_digit()) => {}
                c if c.is_alphanumeric() || matches!(c, '_' | '.') => {}
                _ => break,
            }
            end = at + c.len_utf8();
        }
        let (word, rest) = text.split_at(end);
        if word.is_empty() {
            return None;
        }
        self.rest = rest;
        let constant = match word {
            "true" | "on" => Some(Value::Bool(true)),
            "false" | "off" => Some(Value::Bool(false)),
            "none" => Some(Value::Null),
            word if word.chars().all(|c| c.is_ascii_digit()) => match word.parse::<i64>() {
                Ok(number) => Some(number.into()),
                Err(_) => {
                    return Some(Err(DebugError::new(format!(
                        "`{word}` is too large: numbers go up to {}",
                        i64::MAX
                    ))));
                }
            },
            _ => None,
        };
        Some(match constant {
            Some(value) => Ok(Node::Constant(value)),
            None => match Field::parse(word, self.device) {
                Ok(field) => Ok(Node::Field(field)),
                Err(_) if self.is_compared && !word.contains(['.', '[']) => {
                    Ok(Node::Constant(word.into()))
                }
                Err(error) => Err(error),
            },
        })
    }

    /// What was read, an operator, and what is read behind it.
    fn pair(
        &mut self,
        node: Node,
        operator: Operator,
        other: impl FnOnce(&mut Self) -> Result<Node, DebugError>,
    ) -> Result<Node, DebugError> {
        self.operators += 1;
        if self.operators > OPERATORS_MAX {
            return Err(DebugError::new(format!(
                "too many operators in one expression: it has {OPERATORS_MAX} at most"
            )));
        }
        Ok(Node::Pair(Box::new(node), operator, Box::new(other(self)?)))
    }

    fn symbol(&mut self, symbol: &str) -> bool {
        let rest = self.rest.trim_start().strip_prefix(symbol);
        rest.map(|rest| self.rest = rest).is_some()
    }

    fn word(&mut self, word: &str) -> bool {
        let rest = self.rest.trim_start().strip_prefix(word);
        let ends = |rest: &&str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
        rest.filter(ends).map(|rest| self.rest = rest).is_some()
    }
}

/// A text to log, with expressions in braces: `{x} at {at}`.
pub(crate) fn filled(template: &str, device: &Controller, at: Time) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('{') {
        text.push_str(before);
        let Some((inside, behind)) = after.split_once('}') else {
            text.push('{');
            rest = after;
            continue;
        };
        match Expression::parse(inside, device).and_then(|inside| inside.value(device, at)) {
            Ok(Value::String(value)) => text.push_str(&value),
            Ok(value) => text.push_str(&value.to_string()),
            Err(error) => text.push_str(&format!("<{error}>")),
        }
        rest = behind;
    }
    text.push_str(rest);
    text
}

/// The expressions in braces of such a text.
pub(crate) fn in_braces(template: &str) -> impl Iterator<Item = &str> {
    template.split('{').skip(1).filter_map(|part| Some(part.split_once('}')?.0))
}
