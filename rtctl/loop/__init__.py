"""The real-time side, nothing else: clock, links, mailbox, ring, safety, and the generator of the tick."""
