/* The floor of the path of a state to the client: shared memory and TCP, with nothing else in between.

   A realtime thread writes its time into shared memory every millisecond and wakes another, which sends it as the first
   eight bytes of a frame: when the tick was due [ns of the monotonic clock]. Arguments: frames, bytes of a frame. Prints
   its port, waits for one client, sends all frames and ends. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>

#define PERIOD 1000000LL
/* Priorities of the plant's loop and of the cabinet's sampler. */
#define LOOP 50
#define SAMPLER 10

struct shared {
    pthread_mutex_t lock;
    pthread_cond_t ticked;
    long count;
    long long due;
};

static struct shared *memory;
static long frames;

static void priority(int value) {
    struct sched_param chosen = {.sched_priority = value};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &chosen); /* without the permission it does without */
    prctl(PR_SET_TIMERSLACK, 1);
}

static void *loop(void *unused) {
    (void)unused;
    priority(LOOP);
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    long long due = t.tv_sec * 1000000000LL + t.tv_nsec;
    for (long k = 0; k < frames; k++) {
        due += PERIOD;
        t.tv_sec = due / 1000000000LL;
        t.tv_nsec = due % 1000000000LL;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, 0);
        pthread_mutex_lock(&memory->lock);
        memory->due = due;
        memory->count++;
        pthread_cond_signal(&memory->ticked);
        pthread_mutex_unlock(&memory->lock);
    }
    return 0;
}

int main(int count, char **words) {
    if (count != 3) return 1;
    frames = atol(words[1]);
    size_t size = (size_t)atol(words[2]);
    char *frame = calloc(1, size);
    memory = mmap(0, sizeof *memory, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    pthread_mutex_init(&memory->lock, 0);
    pthread_cond_init(&memory->ticked, 0);
    int server = socket(AF_INET, SOCK_STREAM, 0), on = 1;
    struct sockaddr_in own = {.sin_family = AF_INET};
    socklen_t length = sizeof own;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(server, (struct sockaddr *)&own, sizeof own) || listen(server, 1)) return 1;
    getsockname(server, (struct sockaddr *)&own, &length);
    printf("%d\n", ntohs(own.sin_port));
    fflush(stdout);
    int peer = accept(server, 0, 0);
    setsockopt(peer, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    pthread_t thread;
    pthread_create(&thread, 0, loop, 0);
    priority(SAMPLER);
    for (long sent = 0; sent < frames;) {
        pthread_mutex_lock(&memory->lock);
        while (memory->count == sent) pthread_cond_wait(&memory->ticked, &memory->lock);
        sent = memory->count; /* what was missed is gone, as for a state that is read late */
        memcpy(frame, &memory->due, sizeof memory->due);
        pthread_mutex_unlock(&memory->lock);
        if (send(peer, frame, size, MSG_NOSIGNAL) < 0) return 1;
    }
    pthread_join(thread, 0);
    return 0;
}
