/**
 * Jobs in the isel NC intermediate format: a command a line, and its words.
 *
 * What a command takes is checked by `vimc4 ncp check` and the language server; this tells what is what.
 */

const name = (...names) => token(prec(2, new RegExp(`(?:${names.map(anyCase).join("|")})`)));
const anyCase = (word) => word.replace(/[A-Z]/g, (letter) => `[${letter}${letter.toLowerCase()}]`);

module.exports = grammar({
  name: "ncp",

  extras: (_) => [/[ \t]/],

  rules: {
    source_file: ($) => seq(repeat(seq(optional($._line), $._newline)), optional($._line)),

    _newline: (_) => /\r?\n|\r/,

    _line: ($) => choice(seq($.line_number, optional($._content)), $._content),

    _content: ($) =>
      choice(
        $._comments,
        seq(choice($.mark, $.command, $.unknown), optional($._comments)),
        // Nothing behind the end of a job counts.
        seq(alias($._end, $.command), optional($.after_end)),
      ),

    _comments: ($) => choice($.comment, seq($.bracket_comment, optional($.comment))),

    line_number: (_) => token(prec(1, /[Nn][ \t]*[0-9]+/)),

    // The file mark and TYPE take the rest of their line.
    mark: ($) => seq(field("name", alias($._mark_name, $.mark_name)), optional(field("text", $.text))),
    _mark_name: (_) => token(prec(3, /[Ii][Mm][Ff]_[Pp][Bb][Ll][A-Za-z_]*|[Tt][Yy][Pp][Ee]/)),
    text: (_) => token(prec(4, /[^ \t\r\n][^\r\n]*/)),

    command: ($) =>
      seq(
        field("name", choice($.motion, $.setting, $.output, $.flow)),
        repeat($._argument),
      ),

    motion: (_) =>
      name("MOVEABS", "MOVEREL", "FASTABS", "FASTREL", "CWABS", "CCWABS", "CWREL", "CCWREL", "CWHLXABS", "CCWHLXABS",
        "CWHLXREL", "CCWHLXREL", "REF", "DRILL"),
    setting: (_) =>
      name("VEL", "FASTVEL", "PLANE", "LIMIT", "WPZEROABS", "WPZERO", "WPCLEAR", "WPREG", "METRIC", "INCH", "DRILLDEF",
        "CYL", "ACCEL", "PATHEND", "PATH", "TOOLDEF", "INITTOOL"),
    output: (_) => name("SETPORT", "SETBIT", "RESBIT", "SPINDLE", "COOLANT", "WPCLAMP", "PUMP", "LAMP", "POPTION"),
    flow: (_) => name("HALT", "WAITBIT", "WAITPORT", "WAIT", "GETTOOL", "WPTEACH"),

    _argument: ($) => choice($.constant, $.word, $.number, $.assignment, ","),
    // The longer of the two counts, so that `XYZ` is a word; of the same length the first.
    constant: (_) => token(new RegExp(["ON", "OFF", "ACT", "STANDARD", "CW", "CCW", "XY", "XZ", "YZ", "ZX", "ZY", "YX"].map(anyCase).join("|"))),
    word: (_) => /[A-Za-z]+/,
    number: (_) => /[-+.0-9]+/,
    // The last letter of a value of a port is its base.
    assignment: ($) => seq(choice("=", "=="), field("value", $.port_value)),
    port_value: (_) => token(prec(3, /[0-9A-Fa-f]+[BDHbdh]?/)),

    // As other languages have them; a line with something behind it is another.
    bracket_comment: (_) => /\([^;\r\n]*\)/,
    // A line that begins with something else is for `vimc4 ncp check` to explain.
    unknown: (_) => /[^ \t\r\n;](?:[^\r\n;]*[^ \t\r\n;])?/,

    _end: ($) => field("name", alias($._end_name, $.flow)),
    _end_name: (_) => name("PROGEND"),
    after_end: (_) => token(prec(5, /\s*\S[\s\S]*/)),

    comment: (_) => /;[^\r\n]*/,
  },
});
