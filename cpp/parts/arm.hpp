// ------------------------------------------------------------------------------------------------ arm

namespace heptarm {

/// This computer's clock [ns].
inline std::int64_t now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The cabinet's clock as a function of ours, estimated from pings: the sample with the smallest sum of half its round
/// trip and its age times the drift counts (the clock filter of NTP, RFC 5905, in its simplest form).
class ClockOffset {
public:
    static constexpr double DRIFT = 1e-4;      ///< largest drift between two clocks of nominally equal rate
    static constexpr double TOLERANCE = 3e5;   ///< largest deviation from the estimate that is no step [ns]
    static constexpr std::size_t WINDOW = 64;  ///< samples kept

    /// Args: our clock when a ping was sent, the cabinet's when it arrived, ours when the answer arrived [ns].
    void feed(std::int64_t sent, std::int64_t received, std::int64_t returned) {
        ++count_;
        if (returned < sent) return;
        const Sample sample{0.5 * (double(sent) + double(returned)), double(received), 0.5 * double(returned - sent)};
        if (samples_.size() > 2 && is_step(sample)) samples_.clear();
        samples_.push_back(sample);
        if (samples_.size() > WINDOW) samples_.pop_front();
        rate_ = fit();
        best_ = sample;
        for (const Sample& one : samples_)
            if (one.slack + DRIFT * (sample.ours - one.ours) < best_.slack + DRIFT * (sample.ours - best_.ours)) best_ = one;
    }

    std::size_t count() const { return count_; }
    double rate() const { return rate_; }

    /// A time of our clock as one of the cabinet's [ns].
    std::int64_t to_cabinet(std::int64_t ours) const {
        return static_cast<std::int64_t>(std::llround(best_.theirs + (double(ours) - best_.ours) * rate_));
    }

private:
    struct Sample {
        double ours = 0, theirs = 0, slack = infinite;  // middle of the round trip, the cabinet's clock then, half the trip
    };

    bool is_step(const Sample& sample) const {
        const double since = sample.ours - best_.ours;
        const double off = sample.theirs - (best_.theirs + since * rate_);
        const double drift = rate_ == 1.0 ? DRIFT : 0.01 * rate_;
        return std::fabs(off) > (sample.slack + best_.slack) * std::max(rate_, 1.0) + drift * since + TOLERANCE;
    }

    // the rate nearest to 1 that the best samples of the older and the newer half allow: simulators can run faster
    double fit() const {
        if (samples_.size() < 2) return rate_;
        const auto half = samples_.begin() + static_cast<std::ptrdiff_t>(samples_.size() / 2);
        const auto less = [](const Sample& a, const Sample& b) { return a.slack < b.slack; };
        const Sample older = *std::min_element(samples_.begin(), half, less);
        const Sample newer = *std::min_element(half, samples_.end(), less);
        const double base = newer.ours - older.ours;
        if (base <= 0) return rate_;
        const double rate = (newer.theirs - older.theirs) / base;
        const double slack = (older.slack * std::max(rate_, 1.0) + newer.slack) / base;
        return std::fabs(rate - 1.0) <= slack + DRIFT ? 1.0 : std::max(rate, 0.0);
    }

    std::deque<Sample> samples_;
    Sample best_;
    double rate_ = 1.0;
    std::size_t count_ = 0;
};

/// A TCP connection; POSIX sockets.
class Socket {
public:
    Socket(const std::string& host, std::uint16_t port, double timeout) {
        addrinfo hints{}, *found = nullptr;
        hints.ai_socktype = SOCK_STREAM;
        if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found))
            throw ConnectFailed("no address of " + host + " is known: " + gai_strerror(error));
        int reason = ETIMEDOUT;
        for (const addrinfo* one = found; one != nullptr && file_ < 0; one = one->ai_next) reason = dial(*one, timeout);
        freeaddrinfo(found);
        if (file_ < 0)
            throw ConnectFailed("no connection to " + host + ":" + std::to_string(port) + ": " + std::strerror(reason), 0,
                                "check the address, the network, and that heptarm's application runs on the cabinet");
    }

    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    ~Socket() { ::close(file_); }

    /// Sends all bytes. Throws ConnectionLost; then part of them may have left.
    void send(const Bytes& data) {
        std::size_t sent = 0;
        while (sent < data.size()) {
#ifdef MSG_NOSIGNAL
            const ssize_t size = ::send(file_, data.data() + sent, data.size() - sent, MSG_NOSIGNAL);
#else
            const ssize_t size = ::send(file_, data.data() + sent, data.size() - sent, 0);
#endif
            if (size < 0 && errno == EINTR) continue;
            if (size <= 0) throw ConnectionLost(std::string("the connection broke: ") + std::strerror(errno));
            sent += static_cast<std::size_t>(size);
        }
    }

    /// Waits for bytes until a time [ns]; 0 if none came. Throws ConnectionLost.
    std::size_t receive(std::uint8_t* into, std::size_t size, std::int64_t until) {
        pollfd one{file_, POLLIN, 0};
        const std::int64_t rest = until - now();
        const int ready = ::poll(&one, 1, rest <= 0 ? 0 : static_cast<int>(std::min<std::int64_t>(rest / 1000000 + 1, 60000)));
        if (ready < 0 && errno != EINTR) throw ConnectionLost(std::string("the connection broke: ") + std::strerror(errno));
        if (ready <= 0) return 0;
        const ssize_t got = ::recv(file_, into, size, 0);
        if (got == 0) throw ConnectionLost("the cabinet closed the connection");
        if (got < 0) {
            if (errno == EINTR || errno == EAGAIN) return 0;
            throw ConnectionLost(std::string("the connection broke: ") + std::strerror(errno));
        }
        return static_cast<std::size_t>(got);
    }

    /// Ends the connection for both directions; `receive` in another thread returns.
    void shut_down() { ::shutdown(file_, SHUT_RDWR); }

private:
    // the error number, or 0
    int dial(const addrinfo& address, double timeout) {
        const int file = ::socket(address.ai_family, address.ai_socktype, address.ai_protocol);
        if (file < 0) return errno;
        const int flags = ::fcntl(file, F_GETFL);
        ::fcntl(file, F_SETFL, flags | O_NONBLOCK);
        ::fcntl(file, F_SETFD, FD_CLOEXEC);
        int reason = ::connect(file, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
        if (reason == EINPROGRESS) {
            pollfd one{file, POLLOUT, 0};
            reason = ::poll(&one, 1, static_cast<int>(1000 * timeout)) > 0 ? 0 : ETIMEDOUT;
            socklen_t size = sizeof reason;
            if (reason == 0) ::getsockopt(file, SOL_SOCKET, SO_ERROR, &reason, &size);
        }
        if (reason != 0) {
            ::close(file);
            return reason;
        }
        ::fcntl(file, F_SETFL, flags);
        const int one = 1;
        ::setsockopt(file, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
#ifdef SO_NOSIGPIPE
        ::setsockopt(file, SOL_SOCKET, SO_NOSIGPIPE, &one, sizeof one);
#endif
        timeval limit{};  // a cabinet that reads nothing blocks nobody for ever
        limit.tv_sec = static_cast<time_t>(timeout) + 1;
        ::setsockopt(file, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
        file_ = file;
        return 0;
    }

    int file_ = -1;
};

/// Host and port of "HOST", "HOST:PORT" or "[IPv6]:PORT".
inline std::pair<std::string, std::uint16_t> parse_address(const std::string& text) {
    std::string host = text;
    unsigned long port = wire::PORT;
    const std::size_t colon = text.rfind(':');
    const bool bracketed = !text.empty() && text[0] == '[';
    if (colon != std::string::npos && (bracketed ? text[colon - 1] == ']' : text.find(':') == colon)) {
        const std::string digits = text.substr(colon + 1);
        host = text.substr(0, colon);
        const bool is_number = !digits.empty() && digits.size() < 6 && digits.find_first_not_of("0123456789") == std::string::npos;
        port = is_number ? std::stoul(digits) : 0;
    }
    if (bracketed && host.size() > 1 && host.back() == ']') host = host.substr(1, host.size() - 2);
    if (host.empty() || host.find('/') != std::string::npos || port == 0 || port > 65535)
        throw ConnectFailed("an address is HOST or HOST:PORT, got " + text, 0,
                            "examples: 172.31.1.147, 172.31.1.147:30001, localhost:30001");
    return {host, static_cast<std::uint16_t>(port)};
}

/// Random bytes of the system.
inline Bytes random_bytes(std::size_t size) {
    Bytes out(size);
    std::FILE* file = std::fopen("/dev/urandom", "rb");
    const std::size_t got = file == nullptr ? 0 : std::fread(out.data(), 1, size, file);
    if (file != nullptr) std::fclose(file);
    if (got != size) throw Error("no random bytes: /dev/urandom cannot be read");
    return out;
}

/// Options of a connection.
struct Options {
    std::string name = "C++";           ///< shown to other clients
    std::string key;                    ///< pre-shared key of the cabinet; empty: none
    double timeout = 5.0;               ///< longest wait for the connection and for an answer [s]
    double rate = 100.0;                ///< pushed states per second [Hz]; 0: none
    std::uint16_t groups = 0xFFFF;      ///< groups of the state, of wire::Groups
    double watchdog = 0.5;              ///< silence after which the cabinet counts this client as lost and stops the arm [s]
    std::function<void(const Frame&)> on_event;         ///< each event, in the thread that reads; must not wait
    std::function<void(const wire::State&)> on_state;   ///< each state, likewise
};

/// A pushed state.
struct StateSample {
    wire::State state;
    std::int64_t received = 0;  ///< our clock [ns]
    std::uint64_t number = 0;   ///< counts the states of this connection, from 1
};

/// How a program ended.
struct Result {
    wire::Cause cause = wire::Cause::finished;
    double residual = unset;  ///< largest joint distance between measured and commanded position [rad]
    double duration = 0;    ///< cabinet time [s]
    Joints q{};             ///< measured at the end [rad]
    int item = 0;           ///< motion of the program that ran last
    int fired = -1;         ///< node of the condition that fired; -1: none
    std::string text;       ///< explanation by the cabinet
};

/// The connection behind an arm, its motions and servos. One thread reads and sends pings.
class Link {
public:
    Link(const std::string& address, const Options& options)
        : options_(options), peer_(address), session_(options.key, random_bytes(wire::NONCE)) {
        const auto [host, port] = parse_address(address);
        socket_ = std::make_unique<Socket>(host, port, options.timeout);
        received_ = now();
        try {
            shake_hands();
        } catch (const ConnectFailed&) {
            throw;
        } catch (const Error& error) {
            throw ConnectFailed("no session with " + peer_ + ": " + error.text, error.code, error.advice);
        }
        thread_ = std::thread([this] { run(); });
    }

    Link(const Link&) = delete;
    Link& operator=(const Link&) = delete;

    ~Link() {
        close();
        if (thread_.joinable()) thread_.join();
    }

    const wire::Welcome& welcome() const { return welcome_; }

    /// Sends Goodbye and ends the connection.
    void close() {
        if (!error_at_once()) {
            wire::Goodbye message;
            message.text = "the client closes the session";
            try {
                send(message, 0);
            } catch (const Error&) {
            }
        }
        fail(std::make_exception_ptr(ConnectionLost("the connection to " + peer_ + " is closed")));
    }

    /// Sends a request and waits for its answer. Throws the error of a rejection, with the cabinet's text.
    template <class T>
    Frame request(const T& message) {
        check_may_wait();
        std::unique_lock<std::mutex> lock(mutex_);
        const std::uint32_t id = ++last_request_ == 0 ? ++last_request_ : last_request_;
        pending_[id];
        lock.unlock();
        try {
            send(message, id);
        } catch (...) {
            lock.lock();
            pending_.erase(id);
            throw;
        }
        lock.lock();
        const bool answered =
            wait(lock, options_.timeout, [&] { return pending_[id].has_value(); });
        const std::optional<Frame> answer = std::move(pending_[id]);
        pending_.erase(id);
        if (!answered)
            throw Timeout(std::string("the cabinet did not answer ") + T::NAME + " within " +
                              wire::text_of(options_.timeout) + " s",
                          0, "check the network and the load of both machines");
        lock.unlock();
        if (answer->type == wire::Rejected::TYPE) {
            const auto refused = Session::decode<wire::Rejected>(*answer);
            refuse(refused.code, refused.text, refused);
        }
        return *answer;
    }

    /// Sends a request that is answered with Accepted; its id.
    template <class T>
    std::uint32_t submit(const T& message) {
        return Session::decode<wire::Accepted>(request(message)).id;
    }

    /// Sends a message that is not answered, stamped with the estimated time of the cabinet.
    template <class T>
    void send_one_way(const T& message) {
        transmit([&](std::int64_t time) { return session_.pack(message, 0, offset_.to_cabinet(time)); });
    }

    /// Sends a message; `request` is its id, or 0.
    template <class T>
    void send(const T& message, std::uint32_t request) {
        transmit([&](std::int64_t time) { return session_.pack(message, request, time); });
    }

    /// Pings often enough for a watchdog of this length at the cabinet [s].
    void expect_watchdog(double seconds) {
        const std::lock_guard<std::mutex> lock(mutex_);
        watchdog_ = seconds;
    }

    /// The newest state with a number above `after`. Throws Timeout or ConnectionLost.
    StateSample state(std::uint64_t after, double seconds) {
        check_may_wait();
        std::unique_lock<std::mutex> lock(mutex_);
        if (!wait(lock, seconds, [&] { return newest_.number > after; }))
            throw Timeout("no state received within " + wire::text_of(seconds) + " s", 0, "is a rate subscribed?");
        return newest_;
    }

    /// Number of the states received so far.
    std::uint64_t states() {
        const std::lock_guard<std::mutex> lock(mutex_);
        return newest_.number;
    }

    std::string controller() {
        const std::lock_guard<std::mutex> lock(mutex_);
        return controller_;
    }

    /// Whether a program has begun to move the arm.
    bool has_started(std::uint32_t id) {
        const std::lock_guard<std::mutex> lock(mutex_);
        return programs_[id].started;
    }

    bool has_ended(std::uint32_t id) {
        const std::lock_guard<std::mutex> lock(mutex_);
        return programs_[id].ended.has_value();
    }

    /// Waits until a program has begun or ended.
    bool wait_started(std::uint32_t id, double seconds) {
        check_may_wait();
        std::unique_lock<std::mutex> lock(mutex_);
        return wait(lock, seconds, [&] { return programs_[id].started || programs_[id].ended; });
    }

    /// Waits for the end of a program; none if it did not end in time.
    std::optional<wire::MotionFinished> wait_ended(std::uint32_t id, double seconds) {
        check_may_wait();
        std::unique_lock<std::mutex> lock(mutex_);
        wait(lock, seconds, [&] { return programs_[id].ended.has_value(); });
        return programs_[id].ended;
    }

    std::optional<wire::ServoStatus> servo_status(std::uint32_t id) {
        const std::lock_guard<std::mutex> lock(mutex_);
        return servo_status_ && servo_status_->servo == id ? servo_status_ : std::nullopt;
    }

    /// Cabinet time from a stamp of it to now [s].
    double age(std::int64_t stamp) {
        const std::lock_guard<std::mutex> lock(sending_);
        return 1e-9 * static_cast<double>(offset_.to_cabinet(now()) - stamp);
    }

    /// Throws the error that ended the connection, if one did.
    void check() {
        if (const std::exception_ptr error = error_at_once()) std::rethrow_exception(error);
    }

    const Options& options() const { return options_; }

    /// Notes whether the subscribed states show if the arm rests.
    void expect_states(bool showing_rest) { shows_rest_ = showing_rest; }
    bool shows_rest() const { return shows_rest_; }

private:
    struct Program {
        bool started = false;
        std::optional<wire::MotionFinished> ended;
    };

    static constexpr std::size_t KEPT = 256;  // programs whose events are remembered
    static constexpr int PROBES = 6;

    std::exception_ptr error_at_once() {
        const std::lock_guard<std::mutex> lock(mutex_);
        return error_;
    }

    void check_may_wait() const {
        if (std::this_thread::get_id() == thread_.get_id())
            throw Error("a callback of the thread that reads waited for the cabinet, so for itself", 0,
                        "return from the callback and wait in another thread");
    }

    // waits for a condition; false if it does not hold in time; throws the error that ended the connection
    template <class Condition>
    bool wait(std::unique_lock<std::mutex>& lock, double seconds, Condition holds) {
        const auto ready = [&] { return holds() || error_; };
        if (seconds > 1e6) {
            changed_.wait(lock, ready);
        } else if (!changed_.wait_for(lock, std::chrono::duration<double>(seconds), ready)) {
            return false;
        }
        if (!holds()) std::rethrow_exception(error_);
        return true;
    }

    // packs and sends under one lock, so that frames leave in the order of their sequence numbers
    template <class Pack>
    void transmit(Pack pack) {
        check();
        const std::lock_guard<std::mutex> lock(sending_);
        const Bytes frame = pack(now());
        try {
            socket_->send(frame);
        } catch (const Error&) {
            fail(std::current_exception());  // part of a frame may have left: nothing can follow it
            throw;
        }
    }

    // -------------------------------------------------------------------------------- the handshake

    void shake_hands() {
        const std::int64_t deadline = now() + static_cast<std::int64_t>(options_.timeout * 1e9);
        socket_->send(session_.hello(options_.name, now()));
        while (!session_.is_open()) {
            const Frame frame = next_before(deadline);
            if (frame.type == wire::Challenge::TYPE) {
                socket_->send(session_.proof(frame, now()));
            } else if (frame.type == wire::Welcome::TYPE) {
                welcome_ = session_.welcome(frame);
            } else if (frame.type == wire::Refusal::TYPE) {
                const auto refusal = Session::decode<wire::Refusal>(frame);
                std::string text = refusal.text;
                if (refusal.major != wire::MAJOR)
                    text += (text.empty() ? "" : ": ") + ("the cabinet speaks protocol " + std::to_string(refusal.major)) + "." +
                            std::to_string(refusal.minor) + ", this side " + std::to_string(wire::MAJOR) + "." +
                            std::to_string(wire::MINOR);
                refuse(refusal.code, text);
            } else if (frame.type == wire::Goodbye::TYPE) {
                const auto goodbye = Session::decode<wire::Goodbye>(frame);
                refuse(goodbye.code, goodbye.text);
            }
        }
        controller_ = welcome_.controller;
        for (std::size_t count = 1; count <= PROBES; ++count) {
            wire::Ping ping;
            ping.sent = now();
            socket_->send(session_.pack(ping, 0, now()));
            while (offset_.count() < count) handle(next_before(deadline), now());
            std::this_thread::sleep_for(std::chrono::milliseconds(3));
        }
    }

    Frame next_before(std::int64_t deadline) {
        while (true) {
            if (auto frame = session_.next()) return *frame;
            const std::size_t size = socket_->receive(buffer_.data(), buffer_.size(), deadline);
            session_.feed(buffer_.data(), size);
            if (size == 0 && now() > deadline)
                throw ConnectFailed(peer_ + " accepted the connection but answers nothing", 0,
                                    "check that heptarm's application runs on the cabinet and listens on this port");
        }
    }

    // -------------------------------------------------------------------------------- the thread

    void run() {
        std::int64_t due = now();
        std::int64_t at = due;  // when the last call of `receive` ended
        try {
            while (!error_at_once()) {
                if (now() >= due) {
                    wire::Ping ping;
                    ping.sent = now();
                    send(ping, 0);
                    due = now() + ping_interval();
                }
                // time in which nobody listened is no silence of the cabinet: that before the call, and that by which it
                // ends later than the ping is due, since then this process or its machine stood still
                const std::int64_t begun = now();
                const std::int64_t deaf = begun - at;
                const std::size_t size = socket_->receive(buffer_.data(), buffer_.size(), due);
                at = now();
                received_ = std::min(at, received_ + deaf + std::max<std::int64_t>(at - std::max(due, begun), 0));
                session_.feed(buffer_.data(), size);
                while (const auto frame = session_.next()) {
                    received_ = at;
                    handle(*frame, at);
                }
                const double silence = 1e-9 * static_cast<double>(at - received_);
                const double allowed = std::max(2 * welcome_.heartbeat, 1.0);
                if (silence > allowed)
                    throw ConnectionLost("the connection to " + peer_ + " is lost: nothing received for " +
                                             wire::text_of(silence) + " s, allowed are " + wire::text_of(allowed) + " s",
                                         int(Code::silent), "check the network and the load of both machines");
            }
        } catch (...) {
            fail(std::current_exception());
        }
    }

    // a quarter of the shorter timeout, so that one late ping costs nothing
    std::int64_t ping_interval() {
        const std::lock_guard<std::mutex> lock(mutex_);
        return static_cast<std::int64_t>(std::min(welcome_.heartbeat, watchdog_) / 4 * 1e9);
    }

    void handle(const Frame& frame, std::int64_t at) {
        switch (frame.type) {
            case wire::State::TYPE: return take(Session::decode<wire::State>(frame), at);
            case wire::Ping::TYPE: {
                wire::Pong pong;
                pong.sent = Session::decode<wire::Ping>(frame).sent;
                pong.received = at;
                return send(pong, 0);
            }
            case wire::Pong::TYPE: {
                const auto pong = Session::decode<wire::Pong>(frame);
                const std::lock_guard<std::mutex> lock(sending_);
                return offset_.feed(pong.sent, pong.received, at);
            }
            case wire::Goodbye::TYPE: {
                const auto goodbye = Session::decode<wire::Goodbye>(frame);
                const Meaning meaning = meaning_of(goodbye.code);
                throw ConnectionLost("the cabinet at " + peer_ + " ended the session: " +
                                         (goodbye.text.empty() ? meaning.title : printable(goodbye.text)),
                                     goodbye.code, meaning.advice);
            }
            case wire::Accepted::TYPE:
            case wire::Rejected::TYPE:
            case wire::ProcessData::TYPE: return answer(frame);
            default: break;
        }
        note(frame);
        if (options_.on_event) options_.on_event(frame);
    }

    void take(wire::State state, std::int64_t at) {
        if (options_.on_state) options_.on_state(state);
        const std::lock_guard<std::mutex> lock(mutex_);
        newest_.state = std::move(state);
        newest_.received = at;
        ++newest_.number;
        changed_.notify_all();
    }

    void answer(const Frame& frame) {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto found = pending_.find(frame.request);
        if (found != pending_.end()) found->second = frame;
        changed_.notify_all();
    }

    void note(const Frame& frame) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (frame.type == wire::MotionStarted::TYPE) {
            programs_[Session::decode<wire::MotionStarted>(frame).id].started = true;
        } else if (frame.type == wire::MotionFinished::TYPE) {
            const auto message = Session::decode<wire::MotionFinished>(frame);
            programs_[message.id].ended = message;
        } else if (frame.type == wire::ServoStatus::TYPE) {
            servo_status_ = Session::decode<wire::ServoStatus>(frame);
        } else if (frame.type == wire::ControlChanged::TYPE) {
            controller_ = Session::decode<wire::ControlChanged>(frame).controller;
        }
        while (programs_.size() > KEPT) programs_.erase(programs_.begin());  // ids grow
        changed_.notify_all();
    }

    // the first error is kept
    void fail(const std::exception_ptr& error) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!error_) error_ = error;
        socket_->shut_down();
        changed_.notify_all();
    }

    const Options options_;
    const std::string peer_;
    Session session_;
    std::unique_ptr<Socket> socket_;
    wire::Welcome welcome_;
    std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(65536);
    std::int64_t received_ = 0;

    std::mutex sending_;  // guards sending, and the clock's estimate
    ClockOffset offset_;

    std::mutex mutex_;  // guards everything below
    std::condition_variable changed_;
    std::exception_ptr error_;
    std::map<std::uint32_t, std::optional<Frame>> pending_;
    std::uint32_t last_request_ = 0;
    std::map<std::uint32_t, Program> programs_;
    std::optional<wire::ServoStatus> servo_status_;
    std::string controller_;
    StateSample newest_;
    double watchdog_ = infinite;
    std::atomic<bool> shows_rest_{false};
    std::thread thread_;
};

/// Ends of motions that are no error.
inline bool ended_well(wire::Cause cause) {
    return cause == wire::Cause::finished || cause == wire::Cause::cancelled || cause == wire::Cause::condition ||
           cause == wire::Cause::replaced;
}

/// A program that the cabinet has accepted.
class Motion {
public:
    static constexpr double ARRIVAL_TOLERANCE = 0.02;  ///< [rad]

    Motion(std::shared_ptr<Link> link, std::uint32_t id) : link_(std::move(link)), id_(id) {}

    std::uint32_t id() const { return id_; }
    bool done() const { return link_->has_ended(id_); }

    /// Waits for its end. Throws MotionAborted, Starved, ConnectionLost or the error for which it was not planned, each with
    /// the cabinet's text; Timeout if it still runs after so many seconds.
    Result wait(double seconds = infinite) const {
        const auto message = link_->wait_ended(id_, seconds);
        if (!message) throw Timeout("motion " + std::to_string(id_) + " still runs after " + wire::text_of(seconds) + " s");
        Result result;
        result.cause = message->cause;
        result.residual = message->residual;
        result.duration = message->duration;
        result.q = message->q;
        result.item = message->item;
        result.fired = message->fired;
        result.text = printable(message->text);
        if (!ended_well(message->cause)) raise_end(*message);
        if (message->cause == wire::Cause::finished && result.residual > ARRIVAL_TOLERANCE)
            throw MotionAborted("motion " + std::to_string(id_) + " ended " + wire::text_of(result.residual) +
                                    " rad short of its target; allowed are " + wire::text_of(ARRIVAL_TOLERANCE) + " rad",
                                0, "check whether something blocks the arm, and whether the load data are right");
        return result;
    }

    /// Ends it: it brakes on its path, or leaves the queue. Has no effect once it has ended.
    void cancel() const {
        if (done()) return;
        wire::Cancel message;
        message.id = id_;
        try {
            link_->submit(message);
        } catch (const CommandRejected&) {
            if (!link_->wait_ended(id_, 0.2)) throw;  // otherwise it has just ended by itself
        }
    }

private:
    [[noreturn]] void raise_end(const wire::MotionFinished& end) const {
        const Meaning meaning = meaning_of(end.code);
        const std::string text = "motion " + std::to_string(id_) + " ended early (" + wire::name(end.cause) + "): " +
                                 (end.text.empty() ? meaning.title : printable(end.text));
        if (end.cause == wire::Cause::lost) throw ConnectionLost(text, end.code, meaning.advice);
        if (end.cause == wire::Cause::starved) throw Starved(text, end.code, meaning.advice);
        if (end.cause == wire::Cause::failed && !link_->has_started(id_)) refuse(end.code, text);  // nothing has moved
        throw MotionAborted(text, end.code, meaning.advice);
    }

    std::shared_ptr<Link> link_;
    std::uint32_t id_;
};

/// Settings of a servo motion.
struct ServoOptions {
    double rate = 100.0;         ///< ticks per second [Hz], up to 1000
    double watchdog = unset;       ///< longest gap between two targets [s], 0.005 to 2; NaN: five periods, at least 0.2 s
    wire::ServoEngine engine = wire::ServoEngine::smart;
    double velocity = 0.2;       ///< fraction of each axis' maximum, (0, 1]
    double acceleration = 0.2;   ///< likewise
    wire::CartesianDynamics linear;  ///< limits of the engine `lin`; NaN: 0.25 m/s, 1 m/s², 0.5 rad/s, 2 rad/s²
    std::optional<wire::Mode> mode;  ///< control mode; none: position
    std::string frame;               ///< motion frame; empty: of the attached tool, otherwise the flange
};

/// A stream of targets that the arm follows. Leaving its scope ends the motion at rest.
class Servo {
public:
    Servo(std::shared_ptr<Link> link, const ServoOptions& options) : link_(std::move(link)), options_(options) {
        if (!(options.rate > 0 && options.rate <= 1000))
            throw LimitError("rate must be in (0, 1000] Hz, got " + wire::text_of(options.rate) + " Hz", int(Code::out_of_range));
        if (std::isnan(options_.watchdog)) options_.watchdog = std::min(std::max(5 / options.rate, 0.2), 2.0);
        wire::ServoOpen open;
        open.engine = options.engine;
        open.frame = options.frame;
        open.mode = options.mode;
        open.velocity = options.velocity;
        open.acceleration = options.acceleration;
        open.linear = options.linear;
        if (options.engine == wire::ServoEngine::lin) {
            const auto keep = [](double& value, double usual) { value = std::isnan(value) ? usual : value; };
            open.velocity = open.acceleration = 1.0;
            keep(open.linear.velocity, 0.25);
            keep(open.linear.acceleration, 1.0);
            keep(open.linear.orientation_velocity, 0.5);
            keep(open.linear.orientation_acceleration, 2.0);
        }
        open.timing.min_trajectory_time = std::min(std::max(1 / options.rate + 0.005, 0.001), 1.0);
        open.watchdog = 2.0;  // until the first target: the program may still prepare it
        motion_.emplace(link_, link_->submit(open));
        if (!link_->wait_started(motion_->id(), link_->options().timeout)) {
            motion_->cancel();
            throw Timeout("the servo motion did not begin", 0, "check whether the robot is ready to move, or paused");
        }
        if (motion_->done()) motion_->wait();  // throws why
        if (link_->options().rate > 0) begin_ = link_->state(link_->states(), link_->options().timeout).state.joints;
        start_ = due_ = now();
    }

    Servo(const Servo&) = delete;
    Servo& operator=(const Servo&) = delete;

    ~Servo() {
        try {
            if (motion_) close();
        } catch (const Error&) {  // close() yourself to see it
        }
    }

    /// The joint positions when the motion began [rad]: build targets on them, so that nothing jumps.
    const Joints& start() const {
        if (!begin_) throw Error("the joint positions are not known", 0, "subscribe to the joints: options.rate, options.groups");
        return begin_->q;
    }

    /// Whether the arm follows the targets.
    bool active() const { return !motion_->done(); }

    /// Sends a target [rad]; the newest one counts. It is clipped to the joints' limits. Returns what was sent.
    Joints set(Joints q) {
        clip(q);
        wire::ServoJoints message;
        message.servo = motion_->id();
        message.watchdog = options_.watchdog;
        message.q = q;
        if (active()) link_->send_one_way(message);
        return q;
    }

    /// Sends a target with the velocity to pass it at [rad], [rad/s].
    Joints set(Joints q, const Joints& dq) {
        clip(q);
        wire::ServoJointsVelocity message;
        message.servo = motion_->id();
        message.watchdog = options_.watchdog;
        message.q = q;
        message.dq = dq;
        if (active()) link_->send_one_way(message);
        return q;
    }

    /// Sends a pose of the motion frame.
    void set(const wire::Pose& pose) {
        wire::ServoPose message;
        message.servo = motion_->id();
        message.watchdog = options_.watchdog;
        message.xyz = pose.xyz;
        message.quat = pose.quat;
        if (active()) link_->send_one_way(message);
    }

    /// Waits for the next period; false when the motion has ended (close() throws why).
    bool tick() {
        due_ += static_cast<std::int64_t>(1e9 / options_.rate);
        const std::int64_t at = now();
        if (at < due_)
            std::this_thread::sleep_for(std::chrono::nanoseconds(due_ - at));
        else if (static_cast<double>(at - due_) > 1e9 / options_.rate)
            due_ = at;  // missed periods are not made up for in a burst
        return active();
    }

    /// Time since the motion began [s].
    double t() const { return 1e-9 * static_cast<double>(now() - start_); }

    /// The cabinet's last report on the targets.
    std::optional<wire::ServoStatus> status() const { return link_->servo_status(motion_->id()); }

    /// Ends the motion at rest. Throws the error that ended it early, such as Starved.
    Result close() {
        const Motion motion = *motion_;
        motion.cancel();
        return motion.wait(link_->options().timeout);
    }

private:
    void clip(Joints& q) const {
        const wire::RobotInfo& robot = link_->welcome().robot;
        for (std::size_t i = 0; i < q.size(); ++i)
            if (!std::isnan(q[i])) q[i] = std::min(std::max(q[i], robot.q_min[i]), robot.q_max[i]);
    }

    std::shared_ptr<Link> link_;
    ServoOptions options_;
    std::optional<Motion> motion_;
    std::optional<wire::JointState> begin_;
    std::int64_t start_ = 0, due_ = 0;
};

// ---------------------------------------------------------------------------------- motions, as values

/// Point to point to joint positions [rad]; `speed`: fraction of each axis' maximum, (0, 1].
inline wire::Item ptp(const Joints& q, double speed = 0.2) {
    wire::Ptp motion;
    motion.q = q;
    motion.dynamics.velocity = wire::filled<7>(speed);
    wire::Item item;
    item.motion = motion;
    return item;
}

/// Point to point to a pose of the motion frame in the base frame; it keeps the current arm angle.
inline wire::Item ptp_to(const wire::Pose& target, double speed = 0.2) {
    wire::PtpPose motion;
    motion.target = target;
    motion.dynamics.velocity = wire::filled<7>(speed);
    wire::Item item;
    item.motion = motion;
    return item;
}

/// Straight line of the motion frame to a pose in the base frame; `speed` in m/s.
inline wire::Item lin(const wire::Pose& target, double speed = 0.1) {
    wire::Lin motion;
    motion.target = target;
    motion.dynamics.velocity = speed;
    wire::Item item;
    item.motion = motion;
    return item;
}

/// Straight line by an offset [m]; `reference`: "" for the axes of the motion frame, or "base". `speed` in m/s.
inline wire::Item lin_rel(const std::array<double, 3>& offset, const std::string& reference = "", double speed = 0.1) {
    wire::LinRel motion;
    motion.offset.xyz = offset;
    motion.offset.quat = {0, 0, 0, 1};
    motion.reference = reference;
    motion.dynamics.velocity = speed;
    wire::Item item;
    item.motion = motion;
    return item;
}

// ---------------------------------------------------------------------------------------------- the arm

/// A connected arm. Its methods may be called from any thread. Leaving its scope closes the session; if this client is in
/// control, the cabinet stops the arm.
class Arm {
public:
    /// Connects. Throws ConnectFailed, VersionMismatch. Address: "HOST" or "HOST:PORT".
    explicit Arm(const std::string& address, const Options& options = {}) : link_(std::make_shared<Link>(address, options)) {
        subscribe(options.rate, options.groups);
    }

    /// What the cabinet says of itself: robot and limits, tools, frames, signals.
    const wire::Welcome& welcome() const { return link_->welcome(); }

    /// Takes control. Throws NotInControl; its text names the client that has it.
    void take_control() {
        wire::TakeControl message;
        message.watchdog = link_->options().watchdog;
        link_->expect_watchdog(message.watchdog);
        link_->submit(message);
    }

    /// Gives control back; running motions are stopped.
    void release_control() {
        link_->submit(wire::ReleaseControl{});
        link_->expect_watchdog(infinite);
    }

    /// Name of the client in control; empty: none.
    std::string controller() const { return link_->controller(); }

    /// Runs motions and waits for their end. `state()` then shows the arm at rest, unless another program waits or somebody
    /// pushes the arm.
    Result move(const std::vector<wire::Item>& items) {
        const Motion motion = start(items);
        const Result result = motion.wait();
        settle(motion.id());
        return result;
    }
    Result move(const wire::Item& item) { return move(std::vector<wire::Item>{item}); }

    /// Starts motions, as one program, and returns at once.
    Motion start(const std::vector<wire::Item>& items, wire::When when = wire::When::queue) {
        wire::Run message;
        message.items = items;
        message.when = when;
        return Motion(link_, link_->submit(message));
    }
    Motion start(const wire::Item& item) { return start(std::vector<wire::Item>{item}); }

    /// The motion of a request that `submit` has sent, such as FriOpen.
    Motion motion(std::uint32_t id) const { return Motion(link_, id); }

    /// Starts a servo motion at the current position.
    Servo servo(const ServoOptions& options = {}) { return Servo(link_, options); }

    /// Stops all motions; every client may, also one that only observes.
    void stop(wire::StopKind kind = wire::StopKind::path) {
        wire::Stop message;
        message.kind = kind;
        link_->submit(message);
    }

    /// Factor on every programmed speed, [0, 1].
    void set_override(double value) {
        wire::SetOverride message;
        message.value = value;
        link_->submit(message);
    }

    /// Chooses what is pushed: states per second and groups, of wire::Groups.
    void subscribe(double rate, std::uint16_t groups = 0xFFFF) {
        wire::Subscribe message;
        message.groups = groups & welcome().groups;
        message.rate = std::min(rate, welcome().max_rate);
        link_->submit(message);
        constexpr std::uint16_t needed = wire::Groups::joints | wire::Groups::motion;
        link_->expect_states(rate > 0 && (message.groups & needed) == needed);
    }

    /// The newest state; the first call waits for one.
    wire::State state() const { return next_state(0).state; }

    /// The newest state after the one with this number: `sample = arm.next_state(sample.number)` waits for each new one.
    StateSample next_state(std::uint64_t after) const { return link_->state(after, link_->options().timeout); }

    /// Waits until nothing runs, nothing waits and no axis turns in two consecutive states. Throws Timeout.
    wire::State wait_for_rest(double seconds = 10.0) const {
        const std::int64_t deadline = now() + static_cast<std::int64_t>(seconds * 1e9);
        StateSample sample = next_state(0);
        const std::int64_t first = sample.state.joints ? sample.state.joints->stamp : 0;
        for (int count = 0; count < 2;) {
            if (now() > deadline) throw Timeout("the arm does not rest after " + wire::text_of(seconds) + " s");
            sample = next_state(sample.number);
            count = is_at_rest(sample.state, first) ? count + 1 : 0;
        }
        return sample.state;
    }

    /// Cabinet time from a stamp, such as state.joints->stamp, to now [s].
    double age(std::int64_t stamp) const { return link_->age(stamp); }

    /// Sends any other request of the protocol; the id of its Accepted.
    template <class T>
    std::uint32_t submit(const T& message) {
        return link_->submit(message);
    }

    /// Sends any other request and returns the frame of its answer; Session::decode reads it.
    template <class T>
    Frame request(const T& message) {
        return link_->request(message);
    }

    /// Throws the error that ended the connection, if one did.
    void check() const { link_->check(); }

    /// Ends the session; motions and servos of this arm end with it.
    void close() { link_->close(); }

private:
    static constexpr double AT_REST = 0.01;  // [rad/s]
    static constexpr double SETTLING = 0.5;  // longest wait for a state of the arm at rest after a motion [s]

    /// Waits shortly until a state shows the arm at rest after the end of a program.
    void settle(std::uint32_t program) const {
        if (!link_->shows_rest()) return;
        const std::int64_t deadline = now() + static_cast<std::int64_t>(SETTLING * 1e9);
        try {
            StateSample sample = link_->state(0, SETTLING);
            const std::int64_t first = sample.state.joints ? sample.state.joints->stamp : 0;
            while (now() < deadline) {
                sample = link_->state(sample.number, 1e-9 * static_cast<double>(deadline - now()));
                const auto& motion = sample.state.motion;
                if (motion && (motion->queued != 0 || (motion->motion != 0 && motion->motion != program))) return;
                if (is_at_rest(sample.state, first)) return;
            }
        } catch (const Timeout&) {  // the motion has ended well, however late the states are
        }
    }

    static bool is_at_rest(const wire::State& state, std::int64_t after) {
        if (!state.joints || !state.motion || state.joints->stamp <= after) return false;
        if (state.motion->motion != 0 || state.motion->queued != 0) return false;
        for (const double one : state.joints->dq)
            if (std::fabs(one) >= AT_REST) return false;
        return true;
    }

    std::shared_ptr<Link> link_;
};

/// Stops the arm over a connection of its own, without a session and without a key. Throws ConnectFailed.
inline void halt(const std::string& address, wire::StopKind kind = wire::StopKind::path, double timeout = 5.0) {
    const auto [host, port] = parse_address(address);
    const std::int64_t deadline = now() + static_cast<std::int64_t>(timeout * 1e9);
    Socket socket(host, port, timeout);
    Session session("", Bytes(wire::NONCE));
    wire::Halt message;
    message.kind = kind;
    socket.send(session.pack(message, 0, now()));
    Bytes buffer(4096);
    while (now() < deadline) {
        session.feed(buffer.data(), socket.receive(buffer.data(), buffer.size(), deadline));
        if (const auto frame = session.next()) {
            if (frame->type == wire::Halted::TYPE) return;
            const auto refusal = Session::decode<wire::Refusal>(*frame);
            throw ConnectFailed(address + " refuses the stop: " + printable(refusal.text), refusal.code, "press the emergency stop");
        }
    }
    throw ConnectFailed(address + " does not answer a stop", 0, "press the emergency stop");
}

}  // namespace heptarm
