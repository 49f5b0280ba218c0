//! What a test expects, put as a sentence: each part of it is a class of its own, which has the words
//! that can follow.

use pyo3::exceptions::{PyAttributeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyInt, PyString};
use std::time::Duration;

use crate::{convert, error};

/// A part of a sentence that is not at its end. `vimc4._expect.Said` remembers that it has begun.
#[pyclass(frozen, subclass, module = "vimc4._vimc4")]
pub(crate) struct Part {
    said: Py<PyAny>,
}

#[pymethods]
impl Part {
    fn __bool__(slf: &Bound<'_, Self>) -> PyResult<bool> {
        let text = "a sentence is neither true nor false, for nobody has looked yet: end it with watch() \
                    or so_far(), which raises what is not so";
        Err(Part::wrong(slf, PyTypeError::new_err(text)))
    }

    fn __getattr__(slf: &Bound<'_, Self>, name: &str) -> PyResult<Py<PyAny>> {
        if name.starts_with('_') {
            return Err(PyAttributeError::new_err(name.to_owned()));
        }
        let words = slf.get_type().dir()?;
        let words: Vec<String> = words.extract()?;
        let words = words.into_iter().filter(|word| !word.starts_with('_'));
        let words = words.collect::<Vec<_>>().join(", ");
        let text = format!("a sentence does not go on with `{name}` here; it does with {words}");
        Err(Part::wrong(slf, PyAttributeError::new_err(text)))
    }
}

impl Part {
    /// The sentence has a mistake, which ends it.
    fn wrong(slf: &Bound<'_, Self>, error: PyErr) -> PyErr {
        match slf.get().said.call_method0(slf.py(), "over") {
            Ok(_) => error,
            Err(other) => other,
        }
    }

    fn text(slf: &Bound<'_, Self>, text: &Bound<'_, PyAny>) -> PyResult<String> {
        if let Ok(text) = text.cast::<PyString>() {
            return Ok(text.to_str()?.to_owned());
        }
        let hint = match text.cast::<PyBytes>() {
            Ok(bytes) => format!("; say \"{}\"", vimc4::escape(bytes.as_bytes())),
            Err(_) => String::new(),
        };
        let kind = text.get_type().name()?;
        let text = format!("what is expected is said as a text, not as {kind}{hint}");
        Err(Part::wrong(slf, PyTypeError::new_err(text)))
    }

    fn count(slf: &Bound<'_, Self>, count: &Bound<'_, PyAny>) -> PyResult<u64> {
        if !count.is_instance_of::<PyInt>() || count.is_instance_of::<PyBool>() {
            let kind = count.get_type().name()?;
            let text = format!("how often is said as a whole number, not as {kind}");
            return Err(Part::wrong(slf, PyTypeError::new_err(text)));
        }
        count.extract().map_err(|_| {
            let text = format!("nothing comes {count} times; say a number from 0 to 2^64 - 1");
            Part::wrong(slf, PyValueError::new_err(text))
        })
    }

    fn span(slf: &Bound<'_, Self>, span: &Bound<'_, PyAny>) -> PyResult<Duration> {
        convert::span(span).map_err(|error| Part::wrong(slf, error))
    }
}

/// The parts, each with what it holds of the sentence.
macro_rules! parts {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[pyclass(frozen, extends = Part, module = "vimc4._vimc4")]
        pub(crate) struct $name(vimc4::$name<()>);

        impl $name {
            /// This part comes after another one of the same sentence.
            fn after(part: &Bound<'_, Part>, words: vimc4::$name<()>) -> PyResult<Py<$name>> {
                let py = part.py();
                if let Some(mistake) = words.mistake() {
                    let error = error::raise(py, "Mistake", mistake.to_string());
                    return Err(Part::wrong(part, error));
                }
                $name::of(py, part.get().said.clone_ref(py), words)
            }

            fn of(py: Python<'_>, said: Py<PyAny>, words: vimc4::$name<()>) -> PyResult<Py<$name>> {
                let part = PyClassInitializer::from(Part { said });
                Py::new(py, part.add_subclass($name(words)))
            }

            fn words(&self) -> vimc4::$name<()> {
                self.0.clone()
            }
        }
    )*};
}

parts! {
    /// The beginning of a sentence about what has to happen.
    Expect
    /// A command, of which it is still to be said how often it comes, and perhaps how it is answered.
    CommandClause
    /// Something that happens, of which it is still to be said how often.
    Clauses
    /// A whole sentence.
    Sentence
    /// Whenever something happens …
    Whenever
    /// … a state has to have lasted …
    Must
    /// … something has to follow …
    Following
}

/// A sentence that is to be looked after: plain data.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Expectation(pub(crate) vimc4::Expectation);

impl Expect {
    /// Begins a sentence.
    pub(crate) fn begin(
        py: Python<'_>,
        said: Py<PyAny>,
        names: vimc4::Names,
    ) -> PyResult<Py<Expect>> {
        Expect::of(py, said, vimc4::Expect::of((), names))
    }
}

type Word<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Expect {
    /// A command of this mnemonic, or whose line begins so: `@A`, `@0A5000`.
    fn command(slf: &Bound<'_, Self>, like: Word<'_, '_>) -> PyResult<Py<CommandClause>> {
        let like = Part::text(slf.as_super(), like)?;
        CommandClause::after(slf.as_super(), slf.get().words().command(&like))
    }

    /// A condition becomes true: `z < -5mm`, `port 2 bit 0 on`, `answer error 2`, `line 12`. One that is
    /// so at the beginning becomes so then.
    fn when(slf: &Bound<'_, Self>, condition: Word<'_, '_>) -> PyResult<Py<Clauses>> {
        let condition = Part::text(slf.as_super(), condition)?;
        Clauses::after(slf.as_super(), slf.get().words().when(condition))
    }

    /// A condition never becomes true: `z < -5mm and x < 0`.
    fn never(slf: &Bound<'_, Self>, condition: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let condition = Part::text(slf.as_super(), condition)?;
        Sentence::after(slf.as_super(), slf.get().words().never(condition))
    }

    /// Whenever a condition becomes true, something is so.
    fn whenever(slf: &Bound<'_, Self>, condition: Word<'_, '_>) -> PyResult<Py<Whenever>> {
        let condition = Part::text(slf.as_super(), condition)?;
        Whenever::after(slf.as_super(), slf.get().words().whenever(condition))
    }
}

#[pymethods]
impl CommandClause {
    /// It is answered with this text, without the end of the line.
    fn answered(slf: &Bound<'_, Self>, text: Word<'_, '_>) -> PyResult<Py<CommandClause>> {
        let text = Part::text(slf.as_super(), text)?;
        CommandClause::after(slf.as_super(), slf.get().words().answered(text))
    }

    /// It is answered with an error.
    fn refused(slf: &Bound<'_, Self>) -> PyResult<Py<CommandClause>> {
        CommandClause::after(slf.as_super(), slf.get().words().refused())
    }

    /// It is answered with this error: `2`, `E09`, or the number in it.
    fn refused_with(slf: &Bound<'_, Self>, code: Word<'_, '_>) -> PyResult<Py<CommandClause>> {
        let code = Part::text(slf.as_super(), code)?;
        CommandClause::after(slf.as_super(), slf.get().words().refused_with(&code))
    }

    /// It is answered so much time after it has begun at the latest.
    fn within(slf: &Bound<'_, Self>, span: Word<'_, '_>) -> PyResult<Py<CommandClause>> {
        let span = Part::span(slf.as_super(), span)?;
        CommandClause::after(slf.as_super(), slf.get().words().within(span))
    }

    /// Exactly once.
    fn once(slf: &Bound<'_, Self>) -> PyResult<Py<Sentence>> {
        Sentence::after(slf.as_super(), slf.get().words().once())
    }

    /// Exactly so many times.
    fn times(slf: &Bound<'_, Self>, count: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let count = Part::count(slf.as_super(), count)?;
        Sentence::after(slf.as_super(), slf.get().words().times(count))
    }

    /// So many times or more.
    fn at_least(slf: &Bound<'_, Self>, count: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let count = Part::count(slf.as_super(), count)?;
        Sentence::after(slf.as_super(), slf.get().words().at_least(count))
    }

    /// So many times or less.
    fn at_most(slf: &Bound<'_, Self>, count: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let count = Part::count(slf.as_super(), count)?;
        Sentence::after(slf.as_super(), slf.get().words().at_most(count))
    }

    /// Not at all.
    fn never(slf: &Bound<'_, Self>) -> PyResult<Py<Sentence>> {
        Sentence::after(slf.as_super(), slf.get().words().never())
    }
}

#[pymethods]
impl Clauses {
    /// Exactly once.
    fn once(slf: &Bound<'_, Self>) -> PyResult<Py<Sentence>> {
        Sentence::after(slf.as_super(), slf.get().words().once())
    }

    /// Exactly so many times.
    fn times(slf: &Bound<'_, Self>, count: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let count = Part::count(slf.as_super(), count)?;
        Sentence::after(slf.as_super(), slf.get().words().times(count))
    }

    /// So many times or more.
    fn at_least(slf: &Bound<'_, Self>, count: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let count = Part::count(slf.as_super(), count)?;
        Sentence::after(slf.as_super(), slf.get().words().at_least(count))
    }

    /// So many times or less.
    fn at_most(slf: &Bound<'_, Self>, count: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let count = Part::count(slf.as_super(), count)?;
        Sentence::after(slf.as_super(), slf.get().words().at_most(count))
    }

    /// Not at all.
    fn never(slf: &Bound<'_, Self>) -> PyResult<Py<Sentence>> {
        Sentence::after(slf.as_super(), slf.get().words().never())
    }
}

#[pymethods]
impl Whenever {
    /// This state is so in that moment.
    fn must_be(slf: &Bound<'_, Self>, state: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let state = Part::text(slf.as_super(), state)?;
        Sentence::after(slf.as_super(), slf.get().words().must_be(state))
    }

    /// This state has been so for some time.
    fn must_have_been(slf: &Bound<'_, Self>, state: Word<'_, '_>) -> PyResult<Py<Must>> {
        let state = Part::text(slf.as_super(), state)?;
        Must::after(slf.as_super(), slf.get().words().must_have_been(state))
    }

    /// Something else becomes true, in the same moment or after it.
    fn must_follow(slf: &Bound<'_, Self>, condition: Word<'_, '_>) -> PyResult<Py<Following>> {
        let condition = Part::text(slf.as_super(), condition)?;
        Following::after(slf.as_super(), slf.get().words().must_follow(condition))
    }

    /// A command that begins so is sent, in the same moment or after it.
    fn must_follow_command(slf: &Bound<'_, Self>, like: Word<'_, '_>) -> PyResult<Py<Following>> {
        let like = Part::text(slf.as_super(), like)?;
        Following::after(slf.as_super(), slf.get().words().must_follow_command(&like))
    }
}

#[pymethods]
impl Must {
    /// At least so long.
    fn for_at_least(slf: &Bound<'_, Self>, span: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let span = Part::span(slf.as_super(), span)?;
        Sentence::after(slf.as_super(), slf.get().words().for_at_least(span))
    }
}

#[pymethods]
impl Following {
    /// So much later at the latest.
    fn within(slf: &Bound<'_, Self>, span: Word<'_, '_>) -> PyResult<Py<Sentence>> {
        let span = Part::span(slf.as_super(), span)?;
        Sentence::after(slf.as_super(), slf.get().words().within(span))
    }
}

#[pymethods]
impl Sentence {
    /// What comes next happens after all this.
    fn then(slf: &Bound<'_, Self>) -> PyResult<Py<Expect>> {
        Expect::after(slf.as_super(), slf.get().words().then())
    }

    /// What comes next happens after all this, and no later than so much time after it.
    fn then_within(slf: &Bound<'_, Self>, span: Word<'_, '_>) -> PyResult<Py<Expect>> {
        let span = Part::span(slf.as_super(), span)?;
        Expect::after(slf.as_super(), slf.get().words().then_within(span))
    }

    /// What comes next happens after all this, and no sooner than so much time after it.
    fn then_after(slf: &Bound<'_, Self>, span: Word<'_, '_>) -> PyResult<Py<Expect>> {
        let span = Part::span(slf.as_super(), span)?;
        Expect::after(slf.as_super(), slf.get().words().then_after(span))
    }

    /// What comes next happens before, between or after what was named since the last `then`.
    fn and_(slf: &Bound<'_, Self>) -> PyResult<Py<Expect>> {
        Expect::after(slf.as_super(), slf.get().words().and())
    }

    /// It is right, too, if it never comes to what a rule is about.
    fn if_at_all(slf: &Bound<'_, Self>) -> PyResult<Py<Sentence>> {
        Sentence::after(slf.as_super(), slf.get().words().if_at_all())
    }

    /// Watches from now on.
    fn watch(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        Sentence::end(slf, "watch")
    }

    /// Looks at everything that has happened so far, and raises what is not as it should be.
    fn so_far(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        Sentence::end(slf, "so_far")
    }
}

impl Sentence {
    fn end(slf: &Bound<'_, Self>, how: &str) -> PyResult<Py<PyAny>> {
        let (py, part) = (slf.py(), slf.as_super());
        let expected = slf.get().words().ready().map_err(|mistake| {
            Part::wrong(part, error::raise(py, "Mistake", mistake.to_string()))
        })?;
        let expected = Py::new(py, Expectation(expected))?;
        part.get().said.call_method1(py, how, (expected,))
    }
}
