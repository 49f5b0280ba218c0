//! The behaviour document.
