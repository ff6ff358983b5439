// ------------------------------------------------------------------------------------------------ errors

namespace heptarm {

/// The base of all errors: what was refused, why, and what to do.
class Error : public std::runtime_error {
public:
    /// Args: the text, the number in the protocol's table of codes (0: none), and the remedy.
    explicit Error(const std::string& what, int number = 0, const std::string& remedy = "")
        : std::runtime_error(remedy.empty() ? what : what + " (" + remedy + ")"), text(what), advice(remedy), code(number) {}

    std::string text;    ///< what happened; what the cabinet sent, if it did
    std::string advice;  ///< what to do
    int code;            ///< one of heptarm::Code; 0: none
    std::string parameter, value, allowed;  ///< of a refused value: path of the field, the value, what is allowed
};

/// No answer in time.
struct Timeout : Error {
    using Error::Error;
};

}  // namespace heptarm
