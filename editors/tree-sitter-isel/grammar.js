/**
 * What isel's controllers take, a line at a time: commands of a host, `@0A5000,900`, and the lines of a stored
 * program, `05000,900`.
 *
 * Which model knows which command, and how many numbers it has, is for `vimc4 run` to say.
 */

module.exports = grammar({
  name: "isel",

  extras: (_) => [/[ \t]/],

  rules: {
    source_file: ($) => seq(repeat(seq(optional($._line), $._newline)), optional($._line)),

    _newline: (_) => /\r?\n|\r/,

    _line: ($) => choice($.directive, $.comment, $.direct, $.stored),

    // Lines that begin so mean nothing to a controller, and are not sent to it.
    comment: (_) => token(prec(-1, /[;#][^\r\n]*/)),
    // What a data field is for, as vimc4 reads it.
    directive: ($) => seq(field("name", $.directive_name), field("value", $.text)),
    directive_name: (_) => token(/[;#][;# \t]*(?:model|machine|axes):/),
    text: (_) => token(prec(-2, /[^ \t\r\n][^\r\n]*/)),

    direct: ($) =>
      seq(
        "@",
        field("device", alias(token.immediate(/[ \t]*[0-9]/), $.device)),
        choice(
          seq(field("command", alias($._direct_motion, $.motion)), optional($._numbers)),
          seq(field("command", alias($._direct_setting, $.setting)), optional($._numbers)),
          seq(field("command", alias($._user_text, $.setting)), optional($.text)),
          seq(field("command", alias($._direct_query, $.query)), optional($._numbers)),
          field("command", alias($._diagnosis, $.query)),
          seq(field("command", alias($._direct_output, $.output)), optional($._numbers)),
          field("command", alias($._direct_program, $.program)),
          field("axes", alias($.number, $.axes)),
        ),
      ),

    _direct_motion: (_) => /[AaMmRrSsFwyZ?]/,
    _direct_setting: (_) => /[defGjJNnTz]|I[ACDEFHJLNORSTWXadej]/,
    _user_text: (_) => "IU",
    _direct_query: (_) => /[bhHPUV]/,
    _diagnosis: (_) => /D(?:Rp|Rn|P[012]|O[01]|S[0HL]|H0)/,
    _direct_output: (_) => /[Bg]/,
    _direct_program: (_) => /[ik]/,

    // A stored line begins with its code, also where that is a digit: `01600,3000` is code 0.
    stored: ($) =>
      choice(
        seq(field("command", alias($._stored_motion, $.motion)), optional($._numbers)),
        seq(field("command", alias($._stored_setting, $.setting)), optional($._numbers)),
        seq(field("command", alias($._stored_output, $.output)), optional($._numbers)),
        seq(field("command", alias($._stored_program, $.program)), optional($._numbers)),
      ),

    _stored_motion: (_) => token(/[07mwy]/),
    _stored_setting: (_) => token(/[defjJNnTz]/),
    _stored_output: (_) => token(/[gp]/),
    _stored_program: (_) => token(/[123569o]/),

    _numbers: ($) => seq($.number, repeat(seq(",", $.number))),
    number: (_) => /[-+]?[0-9]+(?:\.[0-9]*)?/,
  },
});
