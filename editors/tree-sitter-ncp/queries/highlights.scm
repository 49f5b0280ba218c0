(line_number) @label
(mark_name) @keyword.directive
(text) @string
(motion) @function
(setting) @keyword
(output) @function.builtin
(flow) @keyword.control
(word) @variable.parameter
(constant) @constant.builtin
(number) @number
(port_value) @number
["=" "=="] @operator
"," @punctuation.delimiter
[(comment) (bracket_comment) (after_end)] @comment
