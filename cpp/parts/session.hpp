// ------------------------------------------------------------------------------------------------ session

namespace heptarm {

/// Text from the network without the characters that could control a terminal.
inline std::string printable(const std::string& text) {
    std::string clean;
    for (const char c : text)
        if (c == '\n' || c == '\t') clean += ' ';
        else if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) clean += c;
    return clean;
}

/// The error of a code, with the cabinet's text and the remedy from the table of codes.
[[noreturn]] inline void refuse(int code, std::string text, const wire::Rejected& refused = {}) {
    const Meaning meaning = meaning_of(code);
    text = printable(text);
    if (text.empty()) text = *meaning.title ? meaning.title : "refused with code " + std::to_string(code);
    if (!refused.parameter.empty() && !refused.value.empty() && text.find(refused.value) == std::string::npos)
        text += ": " + printable(refused.parameter) + " is " + printable(refused.value);
    if (!refused.allowed.empty() && text.find(refused.allowed) == std::string::npos)
        text += "; allowed is " + printable(refused.allowed);
    raise_kind(meaning.kind, text, code, meaning.advice, refused);
}

/// Header and body of one frame.
struct Frame {
    std::uint16_t type = 0;
    std::uint32_t request = 0;
    std::int64_t time = 0;  ///< sender's clock [ns]
    Bytes body;
};

/// The client's side of a session: bytes in, frames out, messages to bytes. It has no socket, no clock and no thread.
class Session {
public:
    static constexpr std::size_t HEADER = 26;

    /// Args: the pre-shared key, empty for none; and 32 random bytes.
    Session(const std::string& key, Bytes nonce) : nonce_(std::move(nonce)) {
        if (!key.empty()) exchange_.emplace(key);
    }

    bool has_key() const { return exchange_.has_value(); }
    bool is_open() const { return open_; }

    /// The first frame of a session.
    Bytes hello(const std::string& name, std::int64_t now) {
        wire::Hello message;
        message.major = wire::MAJOR;
        message.minor = wire::MINOR;
        message.name = name.substr(0, 64);
        message.version = wire::SOFTWARE;
        message.nonce = nonce_;
        return pack(message, 0, now);
    }

    /// A message as a frame. Throws Error, as the cabinet would, for a field outside its range.
    template <class T>
    Bytes pack(const T& message, std::uint32_t request, std::int64_t now) {
        try {
            wire::validate(message);
        } catch (const wire::Violation& found) {
            wire::Rejected refused;
            refused.parameter = found.parameter;
            refused.value = found.value;
            refused.allowed = found.allowed;
            refuse(found.code, "", refused);
        }
        const Bytes body = wire::encode(message);
        if (body.size() > wire::MAX_BODY)
            refuse(int(Code::bad_length), "a body must have at most " + std::to_string(wire::MAX_BODY) + " bytes");
        if (exchange_ && !open_) exchange_->add(T::TYPE, body);
        Bytes frame;
        frame.reserve(HEADER + body.size() + wire::TAG);
        wire::Writer out(frame);
        out.put(wire::MAGIC);
        out.put(static_cast<std::uint8_t>(wire::MAJOR));
        out.put(static_cast<std::uint8_t>(ours_ ? 1 : 0));
        out.put(T::TYPE);
        out.put(static_cast<std::uint32_t>(body.size()));
        out.put(sent_);
        out.put(request);
        out.put(now);
        frame.insert(frame.end(), body.begin(), body.end());
        if (ours_) {
            const key::Digest tag = (*ours_)(sent_round_, frame.data(), frame.size());
            frame.insert(frame.end(), tag.begin(), tag.begin() + wire::TAG);
        }
        if (++sent_ == 0) ++sent_round_;
        return frame;
    }

    /// Adds received bytes; `next` takes the frames out of them.
    void feed(const std::uint8_t* data, std::size_t size) { buffer_.insert(buffer_.end(), data, data + size); }

    /// The next frame; none until more bytes arrive. Throws RemoteProtocolError or ConnectionLost: the session is broken.
    std::optional<Frame> next() {
        const std::uint8_t* data = buffer_.data() + start_;
        const std::size_t size = buffer_.size() - start_;
        if (size >= 2 && (data[0] << 8 | data[1]) != wire::MAGIC)
            refuse(int(Code::bad_frame), size >= 5 && std::memcmp(data, "HTTP/", 5) == 0
                                            ? "a web server (HTTP) answers on this port, not heptarm"
                                            : "the bytes on this port are not heptarm's");
        if (size < HEADER) return std::nullopt;
        wire::Reader in(data + 2, HEADER - 2);
        std::uint8_t version, flags;
        std::uint32_t length, seq;
        Frame frame;
        in.get(version);
        in.get(flags);
        in.get(frame.type);
        in.get(length);
        in.get(seq);
        in.get(frame.request);
        in.get(frame.time);
        if (flags > 1 || length > wire::MAX_BODY) refuse(int(Code::bad_frame), "");
        if ((flags == 1) != theirs_.has_value())
            refuse(int(Code::forged_frame), theirs_ ? "a frame has no tag" : "a frame has a tag, but the session no key");
        const std::size_t whole = HEADER + length + (theirs_ ? wire::TAG : 0);
        if (size < whole) return std::nullopt;
        if (theirs_) {
            const key::Digest tag = (*theirs_)(received_round_, data, HEADER + length);
            if (!key::same(tag.data(), data + HEADER + length, wire::TAG))
                refuse(int(Code::forged_frame), "a frame has a wrong tag");
        }
        // a Refusal is the same in every version, so that it can name both
        if (version != wire::MAJOR && frame.type != wire::Refusal::TYPE && frame.type != wire::Halted::TYPE)
            refuse(int(Code::wrong_version), "a frame has protocol version " + std::to_string(version) +
                                                ", this side has " + std::to_string(wire::MAJOR));
        if (seq != received_) refuse(int(Code::forged_frame), "a frame is out of sequence");
        if (++received_ == 0) ++received_round_;
        frame.body.assign(data + HEADER, data + HEADER + length);
        start_ += whole;
        if (start_ == buffer_.size() || start_ > 65536) {
            buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(start_));
            start_ = 0;
        }
        return frame;
    }

    /// The answer to the cabinet's request for a proof of the key.
    Bytes proof(const Frame& challenge, std::int64_t now) {
        const auto message = decode<wire::Challenge>(challenge);
        if (!exchange_)
            refuse(int(Code::wrong_key), "the cabinet asks for a pre-shared key, none was given");
        if (message.nonce.size() != wire::NONCE || message.nonce == nonce_)
            refuse(int(Code::wrong_key), "the other side sent no nonce of its own");
        exchange_->add(wire::Challenge::TYPE, challenge.body);
        their_nonce_ = message.nonce;
        wire::Proof proof;
        proof.mac = key::bytes(exchange_->client_mac());
        return pack(proof, 0, now);
    }

    /// Opens the session; with a key it checks that the cabinet knows it, too, and begins to tag all frames.
    wire::Welcome welcome(const Frame& frame) {
        const auto message = decode<wire::Welcome>(frame);
        if (exchange_) {
            Bytes bare = frame.body;
            if (message.mac.size() == 32 && !their_nonce_.empty()) {
                bare.resize(bare.size() - 36);
                bare.insert(bare.end(), 4, 0);
                exchange_->add(wire::Welcome::TYPE, bare);
            }
            if (message.mac.size() != 32 || their_nonce_.empty() ||
                !key::same(exchange_->cabinet_mac().data(), message.mac.data(), 32))
                refuse(int(Code::wrong_key), "the cabinet failed to prove that it knows the key");
            const auto [up, down] = exchange_->keys(nonce_, their_nonce_);
            ours_.emplace(up);
            theirs_.emplace(down);
        }
        open_ = true;
        return message;
    }

    /// The message of a frame. Throws RemoteProtocolError.
    template <class T>
    static T decode(const Frame& frame) {
        try {
            return wire::decode<T>(frame.body.data(), frame.body.size());
        } catch (const DecodeError& error) {
            refuse(int(Code::bad_body), std::string(T::NAME) + ": " + error.what());
        }
    }

private:
    Bytes nonce_, their_nonce_;
    std::optional<key::Exchange> exchange_;
    std::optional<key::Hmac> ours_, theirs_;
    bool open_ = false;
    std::uint32_t sent_ = 0, received_ = 0, sent_round_ = 0, received_round_ = 0;
    Bytes buffer_;
    std::size_t start_ = 0;
};

}  // namespace heptarm

