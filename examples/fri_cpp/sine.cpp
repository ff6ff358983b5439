// A client of FRI in plain C++17, without any SDK: overlays a slow sine on whatever the controller lets it command.
//
//     g++ -std=c++17 -O2 -o sine sine.cpp
//     ./sine 30200 1.15                       # and, elsewhere: heptarm sim fri 1.15
//
// It has the habits of the clients that labs write: it sets itself up when MONITORING_READY begins, computes the step of
// its sine from the period that it reads there, sends the measured position in COMMANDING_WAIT, and prints each change of
// the session's state. After SECONDS of commanding (default: none, it goes on) it prints how far the arm has moved.

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "wire.hpp"

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double FREQUENCY = 0.25;                                            // [Hz]
constexpr double ANGLE = 0.04, TORQUE = 15.0, FORCE = 40.0, DISTANCE = 20.0;  // [rad], [Nm], [N], [mm]

class Sine {
public:
    // The answer to a message; what it carries depends on the session's state and on what may be commanded.
    fri::Command answer(const fri::Monitoring& now) {
        if (now.state != state_) {
            std::printf("changed from %d to %d\n", state_, now.state);
            std::fflush(stdout);
            if (now.state == fri::MONITORING_READY) {
                step_ = 2 * PI * FREQUENCY * 1e-3 * now.period * std::max(1, now.multiplier);
                phase_ = 0;
            }
            state_ = now.state;
        }
        fri::Command command;
        if (now.state < fri::COMMANDING_WAIT) {
            command.q = now.commanded;  // only 1.x reports it
        } else if (now.state == fri::COMMANDING_WAIT) {
            start_ = now.measured;
            start_pose_ = now.measured_pose;
            fill(command, now, 0);
        } else {
            if (first_.empty()) first_ = now.measured;
            for (size_t i = 0; i < first_.size(); ++i)
                moved_ = std::max(moved_, std::fabs(now.measured[i] - first_[i]));
            seconds_ += 1e-3 * now.period * std::max(1, now.multiplier);
            phase_ += step_;
            fill(command, now, std::sin(phase_));
        }
        return command;
    }

    double seconds() const { return seconds_; }
    double moved() const { return moved_; }

private:
    void fill(fri::Command& command, const fri::Monitoring& now, double sine) const {
        if (now.mode == fri::POSE) {
            command.pose = start_pose_;
            command.pose.values.at(2) -= DISTANCE * sine;
            return;
        }
        command.q = start_;
        if (now.mode == fri::POSITION) command.q.at(3) += ANGLE * sine;
        if (now.mode == fri::TORQUE) {
            command.tau = fri::Numbers(7, 0.0);
            command.tau[3] = TORQUE * sine;
        }
        if (now.mode == fri::WRENCH) {
            command.wrench = fri::Numbers(6, 0.0);
            command.wrench[2] = FORCE * sine;
        }
    }

    int state_ = fri::IDLE;
    double step_ = 0, phase_ = 0, seconds_ = 0, moved_ = 0;
    fri::Numbers start_, first_;
    fri::Pose start_pose_;
};

}  // namespace

int main(int count, char** arguments) {
    if (count < 3) {
        std::fprintf(stderr, "usage: sine PORT VERSION [SECONDS]\n");
        return 2;
    }
    const bool framed = std::atof(arguments[2]) >= 2.6;
    const double seconds = count > 3 ? std::atof(arguments[3]) : INFINITY;
    int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in own{}, cabinet{};
    own.sin_family = AF_INET;
    own.sin_port = htons(uint16_t(std::atoi(arguments[1])));
    if (bind(socket, reinterpret_cast<sockaddr*>(&own), sizeof own) != 0) {
        std::perror("the port is not available");
        return 2;
    }
    socklen_t length = sizeof own;
    getsockname(socket, reinterpret_cast<sockaddr*>(&own), &length);
    std::printf("waiting on port %d\n", ntohs(own.sin_port));
    std::fflush(stdout);

    Sine sine;
    uint32_t sent = 0;
    int unanswered = 0;
    for (uint8_t data[1500];;) {
        length = sizeof cabinet;
        ssize_t size = recvfrom(socket, data, sizeof data, 0, reinterpret_cast<sockaddr*>(&cabinet), &length);
        if (size < 0) return 1;
        try {
            fri::Monitoring now = fri::read(data, size_t(size));
            fri::Command command = sine.answer(now);
            if (now.state == fri::IDLE) break;
            if (++unanswered < now.multiplier) continue;
            unanswered = 0;
            command.counter = sent++;
            command.reflected = now.counter;
            std::string datagram = fri::write(command, framed);
            sendto(socket, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&cabinet), length);
        } catch (const std::exception& error) {
            std::fprintf(stderr, "not understood: %s\n", error.what());
            return 1;
        }
        if (sine.seconds() >= seconds) {
            std::printf("moved %.4f rad\n", sine.moved());
            return 0;
        }
    }
    return 1;
}
