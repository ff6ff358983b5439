// An application written for KUKA's FRI client SDK, compiled without it: overlays a sine on joint 4, by position or by torque.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "heptarm/fri_client.hpp"

using namespace KUKA::FRI;

class SineClient : public LBRClient {
public:
    void onStateChange(ESessionState before, ESessionState now) override {
        std::printf("changed from %d to %d\n", before, now);
        if (now == MONITORING_READY) {
            step_ = 2 * M_PI * 0.25 * robotState().getSampleTime();
            phase_ = 0;
        }
    }
    void monitor() override { ++monitored_; }
    void waitForCommand() override { robotCommand().setJointPosition(robotState().getMeasuredJointPosition()); ++waited_; }
    void command() override {
        double q[LBRState::NUMBER_OF_JOINTS];
        for (int i = 0; i < LBRState::NUMBER_OF_JOINTS; ++i) q[i] = robotState().getIpoJointPosition()[i];
        phase_ += step_;
        if (robotState().getClientCommandMode() == POSITION) q[3] += 0.04 * std::sin(phase_);
        robotCommand().setJointPosition(q);
        if (robotState().getClientCommandMode() == TORQUE) {
            double tau[LBRState::NUMBER_OF_JOINTS] = {0, 0, 0, 15 * std::sin(phase_)};
            robotCommand().setTorque(tau);
        }
        if (first_ == 0) first_ = robotState().getMeasuredJointPosition()[3];
        moved_ = std::fmax(moved_, std::fabs(robotState().getMeasuredJointPosition()[3] - first_));
        ++commanded_;
    }
    int monitored_ = 0, waited_ = 0, commanded_ = 0;
    double moved_ = 0;

private:
    double step_ = 0, phase_ = 0, first_ = 0;
};

int main(int count, char** arguments) {
    SineClient client;
    UdpConnection connection(20000);
    ClientApplication application(connection, client);
    if (!application.connect(std::atoi(arguments[1]), "127.0.0.1")) return 2;
    const int cycles = count > 2 ? std::atoi(arguments[2]) : 0;
    std::printf("waiting on port %d\n", application.port());
    std::fflush(stdout);
    while (application.step()) {
        if (cycles != 0 && client.commanded_ >= cycles) break;
    }
    std::printf("moved %.4f rad in %d cycles, monitored %d, waited %d\n%s\n", client.moved_, client.commanded_, client.monitored_,
                client.waited_, application.report().c_str());
    application.disconnect();
    return client.commanded_ > 0 ? 0 : 1;
}
