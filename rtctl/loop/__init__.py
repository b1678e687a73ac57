"""The real-time loop: links, mailbox, ring, histograms, and the generator of the tick."""
