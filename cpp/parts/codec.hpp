// ------------------------------------------------------------------------------------------------ codec

namespace heptarm {

using Bytes = std::vector<std::uint8_t>;
using Joints = std::array<double, 7>;

constexpr double infinite = std::numeric_limits<double>::infinity();
/// NaN: a number that was not given.
constexpr double unset = std::numeric_limits<double>::quiet_NaN();

/// The bytes are not a legal body of their message.
struct DecodeError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

namespace wire {

/// What a field may be: a range of its numbers, or of its length.
struct Limits {
    double low = -infinite, high = infinite;
    bool low_open = false;  ///< low itself is not allowed
    bool nan_keeps = false;  ///< NaN is allowed and keeps the cabinet's default
    bool unit_norm = false;  ///< a quaternion
    std::size_t shortest = 0, longest = 65535;
};

/// An array whose numbers are all the same.
template <std::size_t N>
constexpr std::array<double, N> filled(double value) {
    std::array<double, N> all{};
    for (std::size_t i = 0; i < N; ++i) all[i] = value;
    return all;
}

/// Tags of the members of a union, in their order; generated for each of them.
template <class Variant>
struct Tags;

template <class T>
using Integer = std::enable_if_t<std::is_integral_v<T>>;
template <class T>
using Enumeration = std::enable_if_t<std::is_enum_v<T>>;

/// Writes values, big endian.
class Writer {
public:
    explicit Writer(Bytes& out) : out_(out) {}

    /// A field; the visitor that `each` of a struct or a message calls.
    template <class T>
    void operator()(const T& value, const char*, const Limits& = {}) {
        put(value);
    }

    void put(bool value) { out_.push_back(value ? 1 : 0); }

    template <class T, class = Integer<T>>
    void put(T value) {
        const auto number = static_cast<std::make_unsigned_t<T>>(value);
        for (int shift = 8 * (int(sizeof(T)) - 1); shift >= 0; shift -= 8)
            out_.push_back(static_cast<std::uint8_t>(number >> shift));
    }

    void put(double value) {
        std::uint64_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        put(bits);
    }

    template <class T, Enumeration<T>* = nullptr>
    void put(T value) {
        put(static_cast<std::underlying_type_t<T>>(value));
    }

    /// Text after its length; a longer one than the protocol can carry is cut at a character.
    void put(const std::string& value) {
        std::size_t size = std::min<std::size_t>(value.size(), 65535);
        while (size < value.size() && size > 0 && (static_cast<std::uint8_t>(value[size]) & 0xC0) == 0x80) --size;
        put(static_cast<std::uint16_t>(size));
        out_.insert(out_.end(), value.begin(), value.begin() + static_cast<std::ptrdiff_t>(size));
    }

    void put(const Bytes& value) {
        put(static_cast<std::uint32_t>(value.size()));
        out_.insert(out_.end(), value.begin(), value.end());
    }

    template <class T, std::size_t N>
    void put(const std::array<T, N>& values) {
        for (const T& one : values) put(one);
    }

    template <class T>
    void put(const std::vector<T>& values) {
        if (values.size() > 65535) throw std::length_error("a list must have at most 65535 entries");
        put(static_cast<std::uint16_t>(values.size()));
        for (const T& one : values) put(one);
    }

    template <class T>
    void put(const std::optional<T>& value) {
        put(value.has_value());
        if (value) put(*value);
    }

    template <class... Members>
    void put(const std::variant<Members...>& value) {
        put(Tags<std::variant<Members...>>::values[value.index()]);
        std::visit([this](const auto& one) { put(one); }, value);
    }

    template <class T>
    auto put(const T& value) -> decltype(T::each(value, *this)) {
        T::each(value, *this);
    }

private:
    Bytes& out_;
};

/// Whether bytes are UTF-8 (RFC 3629).
inline bool is_utf8(const std::uint8_t* at, const std::uint8_t* end) {
    while (at < end) {
        const std::uint8_t first = *at++;
        if (first < 0x80) continue;
        int more;
        std::uint8_t low = 0x80, high = 0xBF;
        if (first >= 0xC2 && first <= 0xDF) {
            more = 1;
        } else if (first >= 0xE0 && first <= 0xEF) {
            more = 2;
            if (first == 0xE0) low = 0xA0;
            if (first == 0xED) high = 0x9F;
        } else if (first >= 0xF0 && first <= 0xF4) {
            more = 3;
            if (first == 0xF0) low = 0x90;
            if (first == 0xF4) high = 0x8F;
        } else {
            return false;
        }
        for (; more > 0; --more, low = 0x80, high = 0xBF)
            if (at == end || *at < low || *at++ > high) return false;
    }
    return true;
}

/// Reads values; throws DecodeError where the bytes are none.
class Reader {
public:
    Reader(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

    /// A field; the visitor that `each` of a struct or a message calls.
    template <class T>
    void operator()(T& value, const char*, const Limits& = {}) {
        get(value);
    }

    void get(bool& value) {
        const std::uint8_t byte = *take(1);
        if (byte > 1) throw DecodeError("a boolean must be 0 or 1, got " + std::to_string(byte));
        value = byte == 1;
    }

    template <class T, class = Integer<T>>
    void get(T& value) {
        std::make_unsigned_t<T> number = 0;
        const std::uint8_t* data = take(sizeof(T));
        for (std::size_t i = 0; i < sizeof(T); ++i)
            number = static_cast<std::make_unsigned_t<T>>((sizeof(T) > 1 ? number << 8 : 0) | data[i]);
        value = static_cast<T>(number);
    }

    void get(double& value) {
        std::uint64_t bits;
        get(bits);
        std::memcpy(&value, &bits, sizeof value);
    }

    template <class T, Enumeration<T>* = nullptr>
    void get(T& value) {
        std::underlying_type_t<T> number;
        get(number);
        value = static_cast<T>(number);
        if (!is_known(value)) throw DecodeError("an enumeration has no value " + std::to_string(number));
    }

    void get(std::string& value) {
        std::uint16_t size;
        get(size);
        const std::uint8_t* data = take(size);
        if (!is_utf8(data, data + size)) throw DecodeError("a text is not UTF-8");
        value.assign(data, data + size);
    }

    void get(Bytes& value) {
        std::uint32_t size;
        get(size);
        const std::uint8_t* data = take(size);
        value.assign(data, data + size);
    }

    template <class T, std::size_t N>
    void get(std::array<T, N>& values) {
        for (T& one : values) get(one);
    }

    template <class T>
    void get(std::vector<T>& values) {
        std::uint16_t size;
        get(size);
        values.clear();
        for (; size > 0; --size) {
            values.emplace_back();
            get(values.back());
        }
    }

    template <class T>
    void get(std::optional<T>& value) {
        bool present;
        get(present);
        value.reset();
        if (present) get(value.emplace());
    }

    template <class... Members>
    void get(std::variant<Members...>& value) {
        std::uint8_t tag;
        get(tag);
        if (!emplace<0>(value, tag)) throw DecodeError("a union has no member with tag " + std::to_string(tag));
    }

    template <class T>
    auto get(T& value) -> decltype(T::each(value, *this)) {
        T::each(value, *this);
    }

    /// Checks that nothing is left.
    void end(const char* name) const {
        if (at_ != end_) throw DecodeError(std::string(name) + ": " + std::to_string(end_ - at_) + " bytes behind its end");
    }

private:
    const std::uint8_t* take(std::size_t size) {
        if (size > static_cast<std::size_t>(end_ - at_))
            throw DecodeError("body is too short: " + std::to_string(size) + " bytes expected, " +
                              std::to_string(end_ - at_) + " left");
        const std::uint8_t* here = at_;
        at_ += size;
        return here;
    }

    template <std::size_t I, class Variant>
    bool emplace(Variant& value, std::uint8_t tag) {
        if constexpr (I < std::variant_size_v<Variant>) {
            if (Tags<Variant>::values[I] != tag) return emplace<I + 1>(value, tag);
            get(value.template emplace<I>());
            return true;
        } else {
            return false;
        }
    }

    const std::uint8_t *at_, *end_;
};

/// A field is outside the range of the schema; `code` is one of heptarm::Code.
struct Violation : std::runtime_error {
    Violation(int number, const std::string& path, const std::string& given, const std::string& range)
        : std::runtime_error(path + " is " + given + "; allowed is " + range),
          code(number),
          parameter(path),
          value(given),
          allowed(range) {}
    int code;
    std::string parameter, value, allowed;
};

/// A number as text, as short as possible.
inline std::string text_of(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", number);
    return text;
}

/// Checks values against their limits; throws Violation for the first that is outside.
class Checker {
public:
    explicit Checker(std::string path) : path_(std::move(path)) {}

    /// A field; the visitor that `each` of a struct or a message calls.
    template <class T>
    void operator()(const T& value, const char* name, const Limits& limits = {}) {
        check(value, path_ + name, limits);
    }

private:
    void check(bool, const std::string&, const Limits&) {}

    template <class T, std::enable_if_t<std::is_arithmetic_v<T>>* = nullptr>
    void check(T number, const std::string& path, const Limits& limits) {
        const double value = static_cast<double>(number);
        if (std::isnan(value)) {
            if (!limits.nan_keeps) throw Violation(1, path, "NaN", "a finite number");
            return;
        }
        if (std::isinf(value)) throw Violation(1, path, text_of(value), "a finite number");
        if ((limits.low_open ? value <= limits.low : value < limits.low) || value > limits.high)
            throw Violation(2, path, text_of(value),
                            (limits.low_open ? "(" : "[") + text_of(limits.low) + ", " + text_of(limits.high) + "]");
    }

    template <class T, Enumeration<T>* = nullptr>
    void check(T, const std::string&, const Limits&) {}

    void length(std::size_t size, const std::string& path, const Limits& limits) {
        if (size < limits.shortest || size > limits.longest)
            throw Violation(3, path, std::to_string(size) + " long",
                            std::to_string(limits.shortest) + " to " + std::to_string(limits.longest) + " long");
    }

    void check(const std::string& value, const std::string& path, const Limits& limits) {
        length(value.size(), path, limits);
    }

    void check(const Bytes& value, const std::string& path, const Limits& limits) {
        length(value.size(), path, limits);
    }

    template <class T, std::size_t N>
    void check(const std::array<T, N>& values, const std::string& path, const Limits& limits) {
        double squares = 0;
        for (std::size_t i = 0; i < N; ++i) {
            check(values[i], path + "[" + std::to_string(i) + "]", limits);
            squares += static_cast<double>(values[i]) * static_cast<double>(values[i]);
        }
        if (limits.unit_norm && !(std::fabs(std::sqrt(squares) - 1) <= 1e-6))
            throw Violation(4, path, "of norm " + text_of(std::sqrt(squares)), "norm 1");
    }

    template <class T>
    void check(const std::vector<T>& values, const std::string& path, const Limits& limits) {
        length(values.size(), path, limits);
        for (std::size_t i = 0; i < values.size(); ++i)
            check(values[i], path + "[" + std::to_string(i) + "]", Limits{});
    }

    template <class T>
    void check(const std::optional<T>& value, const std::string& path, const Limits& limits) {
        if (value) check(*value, path, limits);
    }

    template <class... Members>
    void check(const std::variant<Members...>& value, const std::string& path, const Limits& limits) {
        std::visit([&](const auto& one) { check(one, path, limits); }, value);
    }

    template <class T>
    auto check(const T& value, const std::string& path, const Limits&)
        -> decltype(T::each(value, std::declval<Checker&>())) {
        Checker inner(path + ".");
        T::each(value, inner);
    }

    std::string path_;
};

/// The body of a message.
template <class T>
Bytes encode(const T& message) {
    Bytes out;
    Writer writer(out);
    T::each(message, writer);
    return out;
}

/// Reads one body, all of it. Throws DecodeError.
template <class T>
T decode(const std::uint8_t* data, std::size_t size) {
    T message;
    Reader reader(data, size);
    T::each(message, reader);
    reader.end(T::NAME);
    return message;
}

/// Throws Violation for a field of a message that is outside its range.
template <class T>
void validate(const T& message) {
    Checker checker("");
    T::each(message, checker);
}

}  // namespace wire
}  // namespace heptarm

