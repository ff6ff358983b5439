// FRI sessions of an `Arm` in C++17: heptarm's cabinet opens the session, the native loop answers it.
#pragma once

#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

#include "fri_loop.hpp"
#include "heptarm.hpp"

namespace heptarm {

struct FriOptions {
    wire::FriCommandMode command = wire::FriCommandMode::position;
    double period = 0.005;           ///< from message to message, whole milliseconds from 1 to 100 [s]
    std::string host;                ///< address of this computer as the cabinet reaches it; needed
    std::vector<std::string> io;     ///< signals of the cabinet that the session carries
    std::optional<wire::Mode> mode;  ///< of the position hold under the overlay: needed for torques and wrenches
    double timeout = 10.0;           ///< for the session to open [s]
    FriGuard guard;
    FriLoop::Law law;                ///< called in each message, in the thread that answers; without it `command` counts
};

/// An FRI session: open from the constructor to `close`, or to the end of its scope. The arm must be in control.
class Fri {
public:
    /// Opens the session and waits until commands are effective, or until it monitors. Throws the cabinet's refusal, or Timeout.
    Fri(Arm& arm, const FriOptions& options) : arm_(arm), loop_(settings(arm, options), options.law) {
        wire::FriOpen message;
        message.host = options.host;
        message.port = loop_.port();
        message.period = options.period;
        message.command = options.command;
        message.io = options.io;
        message.mode = options.mode;
        message.timeout = options.timeout;
        is_monitor_ = options.command == wire::FriCommandMode::monitor;
        thread_ = std::thread([this] { run(); });
        try {
            session_ = arm_.submit(message);
            wait_open(options.timeout + 2.0);
        } catch (...) {
            end();
            throw;
        }
    }

    Fri(const Fri&) = delete;
    Fri& operator=(const Fri&) = delete;

    ~Fri() {
        try {
            close();
        } catch (const std::exception&) {  // close() yourself to see it
        }
    }

    /// Whether commands are effective; of a monitoring session, whether messages may come.
    bool active() const { return !ended_ && (is_monitor_ || state().is_commanding()); }

    /// The newest message.
    FriState state() const { return loop_.state(); }

    /// Waits for a message newer than the last one that it returned; nothing when the session has ended. Throws Timeout.
    std::optional<FriState> next(double seconds = 1.0) {
        const std::int64_t deadline = now() + static_cast<std::int64_t>(seconds * 1e9);
        while (!ended_) {
            const FriState found = loop_.state();
            if (found.number > last_) {
                last_ = found.number;
                if (!is_monitor_ && !found.is_commanding()) return std::nullopt;
                return found;
            }
            if (now() > deadline) throw Timeout("no FRI message came within " + wire::text_of(seconds) + " s");
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
        return std::nullopt;
    }

    /// Commands until the next command; within 50 ms another one is due, or the arm brakes. The guard limits it.
    void position(const Joints& q) { loop_.command(&q); }
    void torque(const Joints& q, const Joints& tau) { loop_.command(&q, &tau); }
    void wrench(const Joints& q, const std::array<double, 6>& wrench) { loop_.command(&q, nullptr, &wrench); }
    /// A pose x y z [m] and quaternion x y z w, on cabinets whose FRI takes poses (2.x); without e1 it is the interpolator's.
    void pose(const std::array<double, 7>& pose, double e1 = std::numeric_limits<double>::quiet_NaN()) {
        loop_.command_pose(pose, e1);
    }

    /// The session's signals with their values in the newest message.
    std::vector<FriSignal> signals() const { return loop_.signals(); }
    /// Writes an output of the session; throws std::invalid_argument if it has none of that name.
    void write(const std::string& name, double value) { loop_.write(name, value); }

    /// Messages, losses, and what the guard limited.
    std::string report() const { return loop_.report(); }
    std::vector<std::string> limited() const { return loop_.limited(); }

    /// Ends overlay and session, and waits until the arm is free for other motions. Throws what the law threw, the error of the
    /// port, or the cabinet's reason if it has ended the session early.
    void close() {
        if (closed_) return;
        closed_ = true;
        if (active() && !is_monitor_) {  // its springs are unwound before the overlay ends
            loop_.release();
            std::this_thread::sleep_for(std::chrono::milliseconds(300));
        }
        const std::uint32_t session = session_;
        end();
        if (error_) std::rethrow_exception(error_);
        if (!is_monitor_) arm_.motion(session).wait(5.0);
    }

private:
    static FriLoopOptions settings(const Arm& arm, const FriOptions& options) {
        if (options.host.empty()) throw CommandRejected("host must be this computer's address as the cabinet reaches it, got none");
        FriLoopOptions made;
        made.model = arm.welcome().robot.model;
        made.guard = options.guard;
        return made;
    }

    void run() {
        sched_param priority{};
        priority.sched_priority = 60;
        pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);  // where it is refused, answers may be late
        try {
            while (loop_.step()) {
            }
        } catch (...) {
            error_ = std::current_exception();
        }
        ended_ = true;
    }

    void wait_open(double seconds) {
        const std::int64_t deadline = now() + static_cast<std::int64_t>(seconds * 1e9);
        const auto target = is_monitor_ ? FriSessionState::monitoring_ready : FriSessionState::commanding_active;
        while (state().session < target) {
            if (ended_ && error_) std::rethrow_exception(error_);
            if (now() > deadline) throw Timeout("the FRI session does not open: " + loop_.report());
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        last_ = state().number - 1;
    }

    void end() {
        if (session_ != 0) {
            wire::FriClose message;
            message.session = session_;
            try {
                arm_.submit(message);
            } catch (const Error&) {  // it has ended by itself, or the connection is lost
            }
            session_ = 0;
        }
        loop_.stop();
        if (thread_.joinable()) thread_.join();
    }

    Arm& arm_;
    FriLoop loop_;
    std::thread thread_;
    std::atomic<bool> ended_{false};
    std::exception_ptr error_;
    std::uint32_t session_ = 0;
    std::int64_t last_ = -1;
    bool is_monitor_ = false, closed_ = false;
};

}  // namespace heptarm
