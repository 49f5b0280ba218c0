//! Requests to the control API of a `vimc4 serve` that runs.

use std::env;
use std::fmt;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::time::Duration;

use serde_json::{Value, json};
use ureq::http::Response;
use ureq::typestate::WithBody;
use ureq::{Agent, RequestBuilder};
use vimc4_answers::problem::parted;

use crate::failure::Failure;
use crate::text;

/// Where the address may stand instead of on the command line.
const URL: &str = "VIMC4_URL";

/// Where the token may stand instead of in a file.
const TOKEN: &str = "VIMC4_TOKEN";

/// So long a server may take to let somebody in. What it is asked may last as long as it likes.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// A server.
#[derive(Clone)]
pub(crate) struct Client {
    agent: Agent,
    /// Its name or address, and its port.
    authority: String,
    token: Option<String>,
}

/// Why there is no answer.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// The server says why: a problem document.
    Refused(Value),
    /// Anything else, in words: most often that there is no server.
    Other(String),
    /// Something at this end.
    Here(Failure),
}

impl Trouble {
    /// What is wrong, and after a semicolon the remedy, if there is one.
    pub(crate) fn text(&self) -> String {
        match self {
            Trouble::Other(why) => why.clone(),
            Trouble::Here(failure) => failure.text(),
            Trouble::Refused(problem) if problem["status"] == 401 => format!(
                "{}; put the one that `vimc4 serve` was given into {TOKEN}, or name its file with \
                 --token",
                part(problem, "detail")
            ),
            Trouble::Refused(problem) => match (part(problem, "detail"), part(problem, "remedy")) {
                ("", _) => part(problem, "title").to_owned(),
                (detail, "") => detail.to_owned(),
                (detail, remedy) => format!("{detail}; {remedy}"),
            },
        }
    }

    /// A problem document: that of the server, if it has sent one.
    pub(crate) fn document(&self) -> Value {
        match self {
            Trouble::Refused(problem) => problem.clone(),
            Trouble::Other(_) | Trouble::Here(_) => {
                let why = self.text();
                let (detail, remedy) = parted(&why).unwrap_or((&why, ""));
                json!({ "title": "There is no answer", "detail": detail, "remedy": remedy })
            }
        }
    }

    /// Whether it was asked for what is right, and cannot be now.
    fn is_passing(&self) -> bool {
        /// A conflict, too many requests, and a controller that has ended.
        const PASSING: [u64; 3] = [409, 429, 503];
        match self {
            Trouble::Refused(problem) => {
                problem["status"].as_u64().is_some_and(|status| PASSING.contains(&status))
            }
            Trouble::Other(_) | Trouble::Here(_) => false,
        }
    }
}

impl From<Trouble> for Failure {
    fn from(trouble: Trouble) -> Failure {
        match trouble {
            Trouble::Here(failure) => failure,
            trouble if trouble.is_passing() => Failure::midway(trouble.text()),
            trouble => Failure::usage(trouble.text()),
        }
    }
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Trouble {
        Trouble::Here(failure)
    }
}

/// A text of a document; empty if it is not there.
pub(crate) fn part<'a>(document: &'a Value, name: &str) -> &'a str {
    document[name].as_str().unwrap_or_default()
}

impl Client {
    /// The server at this address, or at that of the environment, which takes the token in this file, or of the environment.
    pub(crate) fn at(url: Option<&str>, token: Option<&Path>) -> Result<Client, Failure> {
        let given = url.map(str::to_owned).or_else(|| env::var(URL).ok());
        let Some(url) = given.filter(|url| !url.is_empty()) else {
            return Err(Failure::usage(format!(
                "no address is given; give --url http://127.0.0.1:8080 or set {URL}: `vimc4 serve --http` \
                 prints where it listens"
            )));
        };
        let authority = url.strip_prefix("http://").unwrap_or(&url).trim_end_matches('/');
        if authority.is_empty()
            || authority.contains(['/', '@', '?', '#', ' '])
            || !authority.is_ascii()
        {
            return Err(Failure::usage(format!(
                "`{url}` is no address of the API; it is as in http://127.0.0.1:8080"
            )));
        }
        let token = match (token, env::var(TOKEN)) {
            (Some(file), _) => Some(fs::read_to_string(file).map_err(|error| {
                Failure::usage(format!(
                    "cannot read the token in {}: {error}; name the file that `serve --http-token` was given",
                    file.display()
                ))
            })?),
            (None, token) => token.ok(),
        };
        let config = Agent::config_builder()
            // What is wrong is said in the answer.
            .http_status_as_error(false)
            .max_redirects(0)
            // Nobody else is to see the token, or to answer for a machine.
            .proxy(None)
            .timeout_connect(Some(PATIENCE))
            .build();
        let token = token.map(|token| token.trim().to_owned());
        if token.as_ref().is_some_and(|token| !token.bytes().all(|byte| byte.is_ascii_graphic())) {
            return Err(Failure::usage(
                "the token has a blank, a line break or a foreign letter in it, which no token of vimc4 has; give \
                 the one that `serve --http-token` was given, and nothing else",
            ));
        }
        Ok(Client { agent: config.new_agent(), authority: authority.to_owned(), token })
    }

    /// Its name or address, and its port.
    pub(crate) fn authority(&self) -> &str {
        &self.authority
    }

    pub(crate) fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// It is a helper of a shell, which does not wait.
    pub(crate) fn hurried(self, patience: Duration) -> Client {
        let config = Agent::config_builder().http_status_as_error(false).max_redirects(0);
        let config = config.proxy(None).timeout_global(Some(patience)).build();
        Client { agent: config.new_agent(), ..self }
    }

    fn url(&self, path: &str) -> String {
        format!("http://{}/v1{path}", self.authority)
    }

    pub(crate) fn get(&self, path: &str, query: &[(&str, &str)]) -> Result<Value, Trouble> {
        let request = self.agent.get(self.url(path));
        let request =
            query.iter().fold(request, |request, (name, value)| request.query(name, value));
        self.answer(self.proven(request).call())
    }

    pub(crate) fn delete(&self, path: &str) -> Result<Value, Trouble> {
        self.answer(self.proven(self.agent.delete(self.url(path))).call())
    }

    /// Without fields there is no body.
    pub(crate) fn post(&self, path: &str, fields: Value) -> Result<Value, Trouble> {
        self.send(self.agent.post(self.url(path)), fields)
    }

    /// Posts what is answered for as long as the answer is read.
    pub(crate) fn hold(
        &self,
        path: &str,
        fields: &Value,
    ) -> Result<impl Read + Send + use<>, Trouble> {
        let request = self.proven(self.agent.post(self.url(path)));
        match request.content_type("application/json").send(fields.to_string()) {
            Ok(answer) if answer.status().is_success() => Ok(answer.into_body().into_reader()),
            answer => Err(self.answer(answer).err().unwrap_or_else(|| self.is_other())),
        }
    }

    pub(crate) fn put(&self, path: &str, fields: Value) -> Result<Value, Trouble> {
        self.send(self.agent.put(self.url(path)), fields)
    }

    fn send(&self, request: RequestBuilder<WithBody>, fields: Value) -> Result<Value, Trouble> {
        let request = self.proven(request);
        self.answer(match fields {
            Value::Null => request.send_empty(),
            fields => request.content_type("application/json").send(fields.to_string()),
        })
    }

    /// With the token, if there is one.
    fn proven<B>(&self, request: RequestBuilder<B>) -> RequestBuilder<B> {
        match &self.token {
            Some(token) => request.header("authorization", format!("Bearer {token}")),
            None => request,
        }
    }

    fn answer(&self, answer: Result<Response<ureq::Body>, ureq::Error>) -> Result<Value, Trouble> {
        let mut answer = answer.map_err(|error| match error {
            ureq::Error::Io(error) => self.lost(&error),
            ureq::Error::Protocol(_) | ureq::Error::Http(_) => self.is_other(),
            error => self.lost(&error),
        })?;
        let body = answer.body_mut().read_to_string().map_err(|error| self.lost(&error))?;
        let document: Value = serde_json::from_str(&body).map_err(|_| self.is_other())?;
        match answer.status().is_success() {
            true => Ok(document),
            false => Err(Trouble::Refused(document)),
        }
    }

    /// Somebody else listens there: a controller itself, for one.
    fn is_other(&self) -> Trouble {
        Trouble::Other(format!(
            "no API of vimc4 answers at {}; give the address that `vimc4 serve --http` prints",
            text::shown_in_line(&self.authority)
        ))
    }

    pub(crate) fn lost(&self, error: &dyn fmt::Display) -> Trouble {
        Trouble::Other(format!(
            "cannot talk to {}: {error}; is `vimc4 serve --http` running there?",
            text::shown_in_line(&self.authority)
        ))
    }

    /// The number of the controller that is meant: without one it has to be the only one.
    pub(crate) fn controller(&self, number: Option<usize>) -> Result<usize, Trouble> {
        if let Some(number) = number {
            return Ok(number);
        }
        match self.get("", &[])?["controllers"].as_u64() {
            Some(1) => Ok(1),
            Some(count) => Err(Trouble::Refused(json!({
                "detail": format!("there are {count} controllers"),
                "remedy": format!("give --controller, 1 to {count}"),
            }))),
            None => Err(self.lost(&"it is another server")),
        }
    }
}
